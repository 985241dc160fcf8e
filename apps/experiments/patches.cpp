// SPDX-License-Identifier: BSD-3-Clause
#include "patches.h"
#include "evaluate/surface_distance.h"
#include "evaluate/surface_samples.h"
#include "figure_support.h"
#include "scan/random.h"

#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace mrf_apps {

using figures::rounded;
using nlohmann::json;
using pcl::mrf::scan::Hole;
using pcl::mrf::scan::Pattern;
using pcl::mrf::scan::Scan;
using Places = std::vector<Eigen::Vector3d>;

namespace {

constexpr std::size_t minPointsOfHole = 20;

/// Mean distance to the closest point by the side of a square with one point, evenly sampled: .79 to .80 on four
/// shapes.
constexpr double evenSpacing = .8;

const char* nameOf(Pattern pattern)
{
  return pattern == Pattern::even ? "even" : pattern == Pattern::random ? "random" : "scanner";
}

double median(std::vector<double> values)
{
  return summarize(std::move(values)).median;
}

} // namespace

std::vector<std::int32_t> holesOf(const Places& points, const std::vector<Hole>& holes)
{
  std::vector<std::int32_t> result;
  result.reserve(points.size());
  for (const Eigen::Vector3d& point : points) {
    std::int32_t deepest = -1;
    // The boundary belongs to the ball, whichever way it was rounded.
    double min = 1 + 1e-6;
    for (std::size_t h = 0; h < holes.size(); ++h) {
      const double share = (point - holes[h].center).norm() / holes[h].radius;
      if (share < min) {
        min = share;
        deepest = static_cast<std::int32_t>(h);
      }
    }
    result.push_back(deepest);
  }
  return result;
}

std::vector<double> rmsPerHole(const std::vector<double>& distances, const std::vector<std::int32_t>& holes,
                               std::size_t count, std::size_t minPoints)
{
  std::vector<std::vector<double>> perHole(count);
  for (std::size_t i = 0; i < distances.size(); ++i)
    if (holes[i] >= 0)
      perHole[static_cast<std::size_t>(holes[i])].push_back(distances[i]);
  std::vector<double> result;
  result.reserve(count);
  for (std::vector<double>& values : perHole)
    result.push_back(values.size() < std::max<std::size_t>(minPoints, 1) ? std::numeric_limits<double>::quiet_NaN()
                                                                         : summarize(std::move(values)).rms);
  return result;
}

void addPairs(const json& a, const json& b, int group, std::vector<Pair>& pairs)
{
  if (a.contains("failed") || b.contains("failed"))
    return;
  const json &first = a["holes"], &second = b["holes"];
  for (std::size_t h = 0; h < first.size(); ++h)
    if (first[h].is_number() && second[h].is_number())
      pairs.push_back({first[h], second[h], group});
}

Comparison compare(const std::vector<Pair>& pairs, std::uint64_t seed)
{
  Comparison result;
  result.pairs = pairs.size();
  if (pairs.empty())
    return result;
  std::map<int, std::vector<double>> byGroup;
  std::vector<double> ratios;
  ratios.reserve(pairs.size());
  std::size_t below = 0;
  for (const Pair& pair : pairs) {
    ratios.push_back(pair.a / pair.b);
    byGroup[pair.group].push_back(ratios.back());
    below += pair.a < pair.b ? 1 : 0;
  }
  result.shareBelow = static_cast<double>(below) / static_cast<double>(pairs.size());
  result.medianRatio = median(ratios);

  std::vector<std::vector<double>> groups;
  groups.reserve(byGroup.size());
  for (auto& group : byGroup)
    groups.push_back(std::move(group.second));
  constexpr int resamples = 2000;
  pcl::mrf::scan::Random random(seed, 0);
  std::vector<double> medians;
  for (int resample = 0; resample < resamples; ++resample) {
    std::vector<double> drawn;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const std::vector<double>& group = groups[random.index(groups.size())];
      drawn.insert(drawn.end(), group.begin(), group.end());
    }
    medians.push_back(median(std::move(drawn)));
  }
  std::sort(medians.begin(), medians.end());
  const auto quantile = [&](double share) {
    return medians[static_cast<std::size_t>(std::lround(share * (resamples - 1)))];
  };
  result.lower = quantile(.025);
  result.upper = quantile(.975);
  return result;
}

std::vector<ScanObject> patchObjects(const ExperimentOptions& options)
{
  const std::vector<ScanObject> all = scanObjects(options);
  return options.quick ? std::vector<ScanObject>{all.front(), all.back()} : all;
}

Scan simulate(const PatchScan& scan, Laboratory& laboratory)
{
  pcl::mrf::scan::ScanOptions options;
  options.sampling.points = laboratory.options().quick ? 8000 : 28000;
  options.holes = holesPerScan;
  options.smallestHole.value = 4;
  options.largestHole.value = 10;
  options.seed = laboratory.options().seed * 1000 + static_cast<std::uint64_t>(scan.index);
  options.sampling.pattern = laboratory.options().sampling;
  Scan result = simulateScan(*scan.object.load().surface, options, laboratory.execution());
  if (options.sampling.pattern != Pattern::even) {
    const auto points = static_cast<double>(result.clean.size() + result.heldOut.size());
    result.spacing = evenSpacing * std::sqrt(result.visibleArea / points);
  }
  return result;
}

std::string samplingSuffix(const ExperimentOptions& options)
{
  return options.sampling == Pattern::even ? "" : std::string("-") + nameOf(options.sampling);
}

std::string samplingTitle(const ExperimentOptions& options)
{
  return std::string(nameOf(options.sampling)) + " sampling";
}

json measureSurface(const SurfaceMesh& mesh, const LoadedObject& object, const Scan& scan,
                    pcl::mrf::Execution& execution)
{
  const double percent = 100 / scan.diagonal;
  const SurfaceDistance toMesh(mesh);
  json holes = json::array();
  for (const double rms : rmsPerHole(toMesh.distances(scan.heldOut.positions, execution),
                                     holesOf(scan.heldOut.positions, scan.holes), scan.holes.size(), minPointsOfHole))
    holes.push_back(percent * rms);
  const Places samples = sampleSurface(mesh, 30000, 1).positions;
  const std::vector<double> toTruth = object.distances(samples, execution);
  const auto far = std::count_if(toTruth.begin(), toTruth.end(), [&](double d) { return d > .01 * scan.diagonal; });

  pcl::mrf::TriangleMesh plain;
  plain.triangles = mesh.triangles;
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    plain.vertices.push_back(vertex.cast<float>());
  const pcl::mrf::MeshStatistics statistics = pcl::mrf::measure(plain);
  return {{"accuracy", percent * summarize(toMesh.distances(scan.clean.positions, execution)).rms},
          {"holes", holes},
          {"reference", percent * summarize(toTruth).rms},
          {"invented", 100 * static_cast<double>(far) / static_cast<double>(samples.size())},
          {"components", statistics.components},
          {"boundaryLoops", statistics.boundaryLoops},
          {"flaws", statistics.nonManifoldEdges + statistics.nonManifoldVertices + statistics.degenerateTriangles}};
}

json measurePatches(const Method& method, const PatchScan& patchScan, const Scan& scan, Laboratory& laboratory)
{
  const MethodResult result = run(method, scan.cloud, scan.spacing, laboratory.execution());
  json measured = measureSurface(result.mesh, patchScan.object.load(), scan, laboratory.execution());
  measured["processorSeconds"] = result.processorSeconds;
  return measured;
}

void PatchResults::add(const json& measured)
{
  ++scans;
  if (measured.contains("failed")) {
    ++failures;
    return;
  }
  for (const json& hole : measured["holes"])
    if (hole.is_number())
      holes.push_back(hole);
  accuracies.push_back(measured["accuracy"]);
  invented.push_back(measured["invented"]);
  processor.push_back(measured["processorSeconds"]);
  severalComponents += measured["components"].get<int>() > 1 ? 1 : 0;
  flawed += measured["flaws"].get<std::int64_t>() > 0 ? 1 : 0;
}

std::vector<std::string> patchColumns()
{
  return {"scans",
          "failed",
          "holes",
          "hole RMS, median",
          "hole RMS, mean",
          "hole RMS, worst",
          "accuracy RMS, median",
          "invented area %, median",
          "invented area %, worst",
          "scans in several pieces",
          "scans with mesh flaws",
          "CPU s, median"};
}

std::vector<json> patchCells(const PatchResults& results)
{
  const Statistics holes = summarize(results.holes), accuracies = summarize(results.accuracies),
                   invented = summarize(results.invented), seconds = summarize(results.processor);
  const auto cell = [](const Statistics& statistics, double value, int digits) {
    return statistics.count > 0 ? json(rounded(value, digits)) : json();
  };
  return {results.scans,
          results.failures,
          holes.count,
          cell(holes, holes.median, 3),
          cell(holes, holes.mean, 3),
          cell(holes, holes.max, 3),
          cell(accuracies, accuracies.median, 3),
          cell(invented, invented.median, 2),
          cell(invented, invented.max, 2),
          results.severalComponents,
          results.flawed,
          cell(seconds, seconds.median, 2)};
}

} // namespace mrf_apps
