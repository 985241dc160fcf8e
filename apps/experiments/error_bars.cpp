// SPDX-License-Identifier: BSD-3-Clause
#include "bar_figures.h"
#include "comparisons.h"
#include "figure_support.h"
#include "noise.h"
#include "patches.h"
#include "program.h"
#include "real_bars.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace mrf_apps {

using figures::Lazy;
using figures::rounded;
using nlohmann::json;
using pcl::mrf::Execution;
using pcl::mrf::scan::Scan;

namespace {

/// Where errors are looked at: amid points, in fillings, and by the distance to the nearest point.
const std::vector<std::pair<const char*, const char*>>& places()
{
  static const std::vector<std::pair<const char*, const char*>> all = {
      {"measured", "measured surface"},       {"fillings", "fillings"},
      {"near", "points within 1 spacing"},    {"rim", "points 1 to 3 spacings away"},
      {"far", "points 3 to 8 spacings away"}, {"farthest", "points beyond 8 spacings"}};
  return all;
}

constexpr double binEnds[] = {1, 3, 8}; ///< spacings

/// A scan with what it is told of its normals.
struct BarredScan {
  std::string kind; ///< "clean" or "noisy"
  ScanObject object;
  std::string key;
  std::shared_ptr<Lazy<Scan>> scan;
};

std::vector<BarredScan> allScans(Laboratory& laboratory)
{
  const ExperimentOptions& options = laboratory.options();
  std::vector<BarredScan> result;
  const auto add = [&](const char* kind, const ScanObject& object, int index, std::function<Scan()> simulated) {
    result.push_back({kind, object, std::string(kind) + "/" + object.id + "/" + std::to_string(index),
                      std::make_shared<Lazy<Scan>>(std::move(simulated))});
  };
  for (const ScanObject& object : patchObjects(options))
    for (int index = 0; index < scansPerObject(options); ++index)
      add("clean", object, index, [=, &laboratory] { return simulate({object, index}, laboratory); });
  constexpr int noisyScans = 2;
  for (const ScanObject& object : noisyObjects(options))
    for (int index = 0; index < (options.quick ? 1 : noisyScans); ++index)
      add("noisy", object, index, [=, &laboratory] {
        return simulateScan(*object.load().surface, noisyScan(laboratory.options(), index), laboratory.execution());
      });
  return result;
}

SurfaceMesh reconstructWithBars(const BarredScan& barred, Execution& execution)
{
  pcl::mrf::Options options;
  options.remesher.rounds = 0;
  options.uncertainty.compute = true;
  return figures::toSurfaceMesh(figures::reconstruct((*barred.scan)(), barred.kind == "clean", options, execution));
}

std::vector<float> errorsOf(const SurfaceMesh& mesh, const LoadedObject& object, Execution& execution)
{
  const std::vector<double> distances = object.distances(mesh.vertices, execution);
  return {distances.begin(), distances.end()};
}

json measureBars(const BarredScan& barred, Execution& execution)
{
  const Scan& scan = (*barred.scan)();
  const SurfaceMesh mesh = reconstructWithBars(barred, execution);
  const std::vector<SigmaSample> samples = sigmaSamples(mesh, errorsOf(mesh, barred.object.load(), execution));
  const std::vector<double> distances = figures::distancesToPoints(mesh.vertices, scan.cloud.positions, execution);
  std::vector<std::vector<SigmaSample>> bins(std::size(binEnds) + 1);
  for (std::size_t v = 0; v < samples.size(); ++v) {
    const double spacings = distances[v] / scan.spacing;
    const auto bin = std::upper_bound(std::begin(binEnds), std::end(binEnds), spacings) - std::begin(binEnds);
    bins[static_cast<std::size_t>(bin)].push_back(samples[v]);
  }
  const SigmaEvaluation evaluation = evaluateSigma(samples, scan.diagonal);
  const double percent = scan.diagonal / 100;
  json result = {{"measured", toJson(evaluation.measured, percent)},
                 {"fillings", toJson(evaluation.fillings, percent)}};
  addRankings(samples, result);
  for (std::size_t bin = 0; bin < bins.size(); ++bin)
    result[places()[2 + bin].first] = toJson(statisticsOfAll(bins[bin], scan.diagonal), percent);
  return result;
}

/// How the density that a program writes at its own vertices ranks the errors of its own surface.
json measureDensity(const Method& method, const BarredScan& barred, Execution& execution)
{
  const Scan& scan = (*barred.scan)();
  SurfaceMesh mesh =
      method.run(barred.kind == "clean" ? scan.cloud : withEstimatedNormals(scan, execution), scan.spacing, execution);
  const auto density = mesh.scalars.find("value");
  if (density == mesh.scalars.end())
    throw pcl::mrf::InvalidInput("the program wrote no density");
  std::vector<double> doubts;
  for (const float value : density->second)
    doubts.push_back(-static_cast<double>(value));
  // Only errors and areas are looked at.
  mesh.scalars["sigma"].assign(mesh.vertices.size(), 1.f);
  mesh.confidences.assign(mesh.vertices.size(), 1.f);
  return {{"density", ranking(sigmaSamples(mesh, errorsOf(mesh, barred.object.load(), execution)), doubts)}};
}

/// A number of each scan, by objects.
class ByObject {
public:
  void add(const std::string& object, const json& value)
  {
    if (!value.is_number())
      return;
    const auto at = static_cast<std::size_t>(std::find(names_.begin(), names_.end(), object) - names_.begin());
    if (at == names_.size()) {
      names_.push_back(object);
      values_.emplace_back();
    }
    values_[at].push_back(value);
  }

  bool empty() const { return names_.empty(); }
  const std::vector<std::string>& names() const { return names_; }

  /// The mean of an object's scans.
  double of(std::size_t object) const
  {
    double sum = 0;
    for (const double value : values_[object])
      sum += value;
    return sum / static_cast<double>(values_[object].size());
  }

  /// Of the objects, each of which counts the same.
  double mean() const
  {
    double sum = 0;
    for (std::size_t n = 0; n < names_.size(); ++n)
      sum += of(n);
    return sum / static_cast<double>(names_.size());
  }

  /// 95 % of that mean: the percentile bootstrap over objects, whose scans have shapes in common.
  std::pair<double, double> interval() const
  {
    constexpr std::size_t resamples = 2000, tail = 50;
    std::mt19937_64 random(1);
    std::vector<double> means;
    for (std::size_t n = 0; n < resamples; ++n) {
      double sum = 0;
      for (std::size_t i = 0; i < names_.size(); ++i)
        sum += of(random() % names_.size());
      means.push_back(sum / static_cast<double>(names_.size()));
    }
    std::sort(means.begin(), means.end());
    return {means[tail], means[resamples - 1 - tail]};
  }

private:
  std::vector<std::string> names_;
  std::vector<std::vector<double>> values_;
};

struct MeasuredBars {
  std::string kind, object;
  json result;
};

/// \param number of a result; null where it has none
template <typename Number>
ByObject collect(const std::vector<MeasuredBars>& all, const std::string& kind, const Number& number)
{
  ByObject result;
  for (const MeasuredBars& measured : all)
    if (measured.kind == kind && !measured.result.contains("failed"))
      result.add(measured.object, number(measured.result));
  return result;
}

json meanOf(const ByObject& values)
{
  return values.empty() ? json() : json(rounded(values.mean()));
}

/// \param level of SigmaStatistics::levels
ByObject coverage(const std::vector<MeasuredBars>& all, const std::string& kind, const std::string& place,
                  std::size_t level)
{
  return collect(all, kind, [&](const json& result) {
    return result[place].is_null() ? json() : json(100 * result[place]["coverage"][level].get<double>());
  });
}

constexpr std::size_t level95 = 2;

Table coverageTable(const std::vector<MeasuredBars>& all)
{
  Table table{"uncertainty-coverage",
              "How often the truth is within the intervals, % of the area, and how wide they are",
              {"scans", "where", "50 %", "80 %", "95 %", "95 % from", "to", "worst object",
               "RMS error, % of the diagonal", "median half-width of 95 % / RMS error"},
              {}};
  for (const char* kind : {"clean", "noisy"})
    for (const auto& [place, title] : places()) {
      const std::string name = place;
      std::vector<json> row = {kind, title};
      for (std::size_t level = 0; level < SigmaStatistics::levels.size(); ++level)
        row.push_back(meanOf(coverage(all, kind, name, level)));
      const ByObject held = coverage(all, kind, name, level95);
      if (held.empty())
        row.insert(row.end(), 3, json());
      else {
        const auto [lower, upper] = held.interval();
        double worst = 100;
        for (std::size_t n = 0; n < held.names().size(); ++n)
          worst = std::min(worst, held.of(n));
        for (const double value : {lower, upper, worst})
          row.push_back(rounded(value));
      }
      const auto number = [&](const char* of) {
        return collect(all, kind,
                       [&](const json& result) { return result[name].is_null() ? json() : result[name][of]; });
      };
      row.push_back(meanOf(number("rms")));
      row.push_back(meanOf(collect(all, kind, [&](const json& result) {
        const json& statistics = result[name];
        return statistics.is_null() || !(statistics["rms"].get<double>() > 0)
                   ? json()
                   : json(statistics["halfWidth"].get<double>() / statistics["rms"].get<double>());
      })));
      table.rows.push_back(row);
    }
  return table;
}

Table objectTable(const std::vector<MeasuredBars>& all)
{
  Table table{"uncertainty-objects",
              "The 95 % interval by object: % of the area within it",
              {"scans", "object", "measured surface", "fillings"},
              {}};
  for (const char* kind : {"clean", "noisy"}) {
    const ByObject measured = coverage(all, kind, "measured", level95),
                   fillings = coverage(all, kind, "fillings", level95);
    for (std::size_t n = 0; n < measured.names().size(); ++n) {
      const auto found = std::find(fillings.names().begin(), fillings.names().end(), measured.names()[n]);
      table.rows.push_back(
          {kind, measured.names()[n], rounded(measured.of(n)),
           found == fillings.names().end()
               ? json()
               : json(rounded(fillings.of(static_cast<std::size_t>(found - fillings.names().begin()))))});
    }
  }
  if (table.rows.empty())
    table.rows.push_back({"all", "every scan failed", json(), json()});
  return table;
}

Table rankingTable(const std::vector<MeasuredBars>& all, bool hasDensity)
{
  Table table{"uncertainty-ranking",
              "What ranks the errors best: sparsification (0 is perfect) and rank correlation",
              {"scans", "predictor", "sparsification", "rank correlation"},
              {}};
  std::vector<std::pair<std::string, std::string>> predictors = {{"sigma", "sigma"}, {"confidence", "our confidence"}};
  if (hasDensity)
    predictors.emplace_back("density", "PoissonRecon --density, on its own surface");
  for (const char* kind : {"clean", "noisy"})
    for (const auto& predictor : predictors) {
      std::vector<json> row = {kind, predictor.second};
      for (const char* what : {"sparsification", "rank"})
        row.push_back(meanOf(collect(all, kind, [&](const json& result) {
          return result.contains(predictor.first) ? result[predictor.first][what] : json();
        })));
      table.rows.push_back(row);
    }
  return table;
}

/// Half-widths beside true errors on one scale, of the first scan.
void addPictures(const std::vector<BarredScan>& scans, const std::vector<MeasuredBars>& all, Laboratory& laboratory,
                 Section& section)
{
  if (all.empty() || all.front().result.contains("failed"))
    return;
  const BarredScan& shown = scans.front();
  constexpr double limitPercent = 1;
  const auto draw = [&](const char* file, const std::string& title, bool areErrors) {
    PictureOptions picture;
    picture.width = picture.height = 800;
    picture.legend = figures::errorLegend(title + ", % of the diagonal", limitPercent);
    laboratory.draw(file, picture, [&] {
      SurfaceMesh mesh = reconstructWithBars(shown, laboratory.execution());
      const std::vector<float> errors = errorsOf(mesh, shown.object.load(), laboratory.execution());
      const std::vector<float>& sigmas = mesh.scalars.at("sigma");
      const double limit = limitPercent / 100 * (*shown.scan)().diagonal;
      mesh.colors.clear();
      for (std::size_t v = 0; v < errors.size(); ++v)
        mesh.colors.push_back(figures::errorColor(
            areErrors ? static_cast<double>(errors[v]) : pcl::mrf::halfWidthPerSigma * static_cast<double>(sigmas[v]),
            limit));
      return mesh;
    });
    section.pictures.push_back({file, shown.object.title + ": " + title});
  };
  draw("uncertainty-half-width.png", "half-width of the 95 % interval", false);
  draw("uncertainty-error.png", "distance to the object", true);
}

} // namespace

Section errorBars(Laboratory& laboratory)
{
  const std::string program = findProgram("PoissonRecon");
  const Method density = programMethod("PoissonRecon", "PoissonRecon", program, 8, {"--density"});
  const std::vector<BarredScan> scans = allScans(laboratory);
  std::vector<MeasuredBars> all;
  for (const BarredScan& barred : scans) {
    json result =
        laboratory.measure("uncertainty/" + barred.key, [&] { return measureBars(barred, laboratory.execution()); });
    if (!program.empty()) {
      const json ofDensity = laboratory.measure("uncertainty/" + barred.key + "/density", [&] {
        return measureDensity(density, barred, laboratory.execution());
      });
      if (ofDensity.contains("density"))
        result["density"] = ofDensity["density"];
    }
    all.push_back({barred.kind, barred.object.title, std::move(result)});
  }

  Section section{"uncertainty", "Error bars", {}, {}, {}, {}};
  section.paragraphs = {
      "Clean scans are those of Table 1, with exact points and normals; noisy ones those of Fig. 8, with noise of "
      ".25 % of the diagonal, 1 % outliers and no normals. Every scan has holes of 4 to 10 % of the diagonal. The "
      "error of a vertex is its distance to the object, and each stands for the area around it. An interval of 50, "
      "80 or 95 % is right if it holds as large a share of the area, and the narrower the better. Objects count the "
      "same, and the interval of a coverage is a bootstrap over objects.",
      "Ranking: sparsification leaves out the area that is predicted to be the worst, more and more of it, and "
      "looks at the RMS error of the rest, beside that of leaving out what is the worst; 0 is perfect. Confidence "
      "falls with the distance to the nearest point.",
      "Real clouds are those of `real`, with the same points withheld and with normals given. A withheld point that "
      "was measured has noise of its own: what has to hold it is an interval of the surface's sigma and the noise "
      "together, the noise being what the report says of the cloud. Points that were simulated are withheld without "
      "noise. The random tenth tells of measured surface, discs with radii of 5 to 10 local spacings of fillings; "
      "those farther than 10 local spacings from any surface are without one, and not counted. Likelihoods refer to "
      "the spacing."};
  if (program.empty())
    section.paragraphs.push_back("The density that PoissonRecon writes is not compared: the program is not on PATH.");
  section.tables = {coverageTable(all), objectTable(all), rankingTable(all, !program.empty()), realBars(laboratory)};
  addPictures(scans, all, laboratory, section);
  return section;
}

} // namespace mrf_apps
