// SPDX-License-Identifier: BSD-3-Clause
#include "real_bars.h"

#include "bar_figures.h"
#include "evaluate/local_spacing.h"
#include "figure_support.h"
#include "real_clouds.h"

#include <pcl/surface/mrf/exceptions.h>

namespace mrf_apps {

using figures::rounded;
using nlohmann::json;
using pcl::mrf::Execution;

namespace {

/// What is withheld, under the names of results and in words.
constexpr std::pair<const char*, const char*> binPlaces[] = {
    {"random", "random tenth"}, {"discs", "discs"}, {"all", "both"}};

/// Withheld points. Those that have no surface near them say nothing of sigma, and are counted.
struct WithheldPoints {
  std::vector<SigmaSample> samples; ///< of the others
  std::size_t lost = 0;

  void add(const WithheldPoints& other)
  {
    samples.insert(samples.end(), other.samples.begin(), other.samples.end());
    lost += other.lost;
  }
};

WithheldPoints compare(const SurfaceMesh& mesh, const std::vector<Eigen::Vector3d>& points, double noise,
                       const LocalSpacing& input, Execution& execution)
{
  constexpr double farthest = 10; // local spacings
  WithheldPoints result;
  if (points.empty())
    return result;
  const std::vector<NearestPoint> nearest = input.nearest(points, execution);
  const std::vector<SigmaSample> samples = sigmaSamples(mesh, points, noise, execution);
  for (std::size_t p = 0; p < points.size(); ++p)
    if (samples[p].error > farthest * input.spacings()[nearest[p].point])
      ++result.lost;
    else
      result.samples.push_back(samples[p]);
  return result;
}

/// \return null of no points
json toJson(const WithheldPoints& withheld, double spacing)
{
  const auto near = static_cast<double>(withheld.samples.size()), lost = static_cast<double>(withheld.lost);
  if (!(near + lost > 0))
    return nullptr;
  json result = {{"lost", lost / (near + lost)}};
  if (near > 0) {
    result.update(toJson(statisticsOfAll(withheld.samples, spacing), spacing));
    addRankings(withheld.samples, result);
  }
  return result;
}

json measureBars(const RealCloud& cloud, Execution& execution)
{
  pcl::mrf::Options options;
  options.remesher.rounds = 0;
  options.uncertainty.compute = true;
  const pcl::mrf::Reconstruction result = reconstruct(cloud, true, options, execution);
  const SurfaceMesh mesh = figures::toSurfaceMesh(result);
  const LocalSpacing input(cloud.input.positions, execution);
  if (input.spacings().empty())
    throw pcl::mrf::InvalidInput("the cloud has too few points");
  const double spacing = summarize(input.spacings()).median;
  const double noise = result.report.uncertainty.noise;
  const auto withheld = [&](const std::vector<Eigen::Vector3d>& points) {
    return compare(mesh, points, cloud.isWithheldNoisy ? noise : 0, input, execution);
  };
  const WithheldPoints random = withheld(cloud.random), discs = withheld(cloud.discs);
  WithheldPoints all = random;
  all.add(discs);
  return {{"noise", noise / spacing},
          {"random", toJson(random, spacing)},
          {"discs", toJson(discs, spacing)},
          {"all", toJson(all, spacing)}};
}

/// What follows the names of cloud and place.
std::vector<json> figuresOf(const json& result, const json& noise)
{
  const auto number = [](const json& value, double factor) {
    return value.is_number() ? json(rounded(factor * value.get<double>())) : json();
  };
  std::vector<json> row = {result.value("vertices", 0), number(result["lost"], 100)};
  if (!result.contains("vertices"))
    return row;
  for (std::size_t level = 0; level < SigmaStatistics::levels.size(); ++level)
    row.push_back(number(result["coverage"][level], 100));
  row.push_back(number(noise, 1));
  row.push_back(number(result["rms"], 1));
  const double rms = result["rms"];
  row.push_back(rms > 0 ? number(result["halfWidth"], 1 / rms) : json());
  row.push_back(number(result["likelihood"], 1));
  for (const char* predictor : {"sigma", "confidence"})
    row.push_back(number(result[predictor]["sparsification"], 1));
  return row;
}

} // namespace

Table realBars(Laboratory& laboratory)
{
  Table table{"uncertainty-real",
              "Real clouds: how often the interval around the surface holds a withheld point, %",
              {"cloud", "withheld", "points", "without surface, %", "50 %", "80 %", "95 %", "noise, spacings",
               "RMS, spacings", "median half-width of 95 % / RMS", "likelihood", "sparsification by sigma",
               "by confidence"},
              {}};
  for (const RealCase& oneCase : realClouds(laboratory.options(), laboratory.execution())) {
    const json measured = laboratory.measure("uncertainty/real/" + oneCase.id,
                                             [&] { return measureBars(oneCase.load(), laboratory.execution()); });
    for (const auto& [place, title] : binPlaces) {
      std::vector<json> row = {oneCase.title, title};
      if (measured.contains("failed"))
        row.push_back(measured["failed"]);
      else if (!measured[place].is_null())
        for (json& figure : figuresOf(measured[place], measured["noise"]))
          row.push_back(std::move(figure));
      row.resize(table.columns.size());
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

} // namespace mrf_apps
