// SPDX-License-Identifier: BSD-3-Clause
#include "noise.h"
#include "evaluate/surface_samples.h"
#include "figure_support.h"
#include "patches.h"
#include "points/normals.h"
#include "program.h"
#include "run/gathering.h"
#include "run/preprocessing.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>

#include <algorithm>

namespace mrf_apps {

using figures::text;
using nlohmann::json;
using pcl::mrf::Execution;
using pcl::mrf::Options;
using pcl::mrf::scan::Length;
using pcl::mrf::scan::Points;
using pcl::mrf::scan::Scan;
using pcl::mrf::scan::ScanOptions;

namespace {

void add(Points& points, const Eigen::Vector3d& position, const Eigen::Vector3f& normal)
{
  points.positions.push_back(position);
  points.normals.emplace_back(normal.cast<double>());
}

} // namespace

ScanOptions baseScan(const ExperimentOptions& options)
{
  ScanOptions scan;
  scan.sampling.points = options.quick ? 6000 : 28000;
  scan.seed = options.seed;
  return scan;
}

std::vector<ScanObject> noisyObjects(const ExperimentOptions& options)
{
  std::vector<ScanObject> result = scanObjects(options);
  const auto rank = [](const ScanObject& object) { return object.id == "igea" || object.id == "nefertiti" ? 0 : 1; };
  std::stable_sort(result.begin(), result.end(),
                   [&](const ScanObject& a, const ScanObject& b) { return rank(a) < rank(b); });
  result.resize(std::min<std::size_t>(result.size(), options.quick ? 1 : 4));
  return result;
}

ScanOptions noisyScan(const ExperimentOptions& options, int index)
{
  ScanOptions scan = baseScan(options);
  scan.noise = {.25, Length::Unit::diagonalPercent};
  scan.uniformOutliers = 1;
  scan.holes = holesOfNoisyScan;
  scan.smallestHole = {4, Length::Unit::diagonalPercent};
  scan.largestHole = {10, Length::Unit::diagonalPercent};
  scan.seed = options.seed * 1000 + static_cast<std::uint64_t>(index);
  return scan;
}

NoisyMethod oursOnNoise(const std::string& id, const std::string& title, const Change& change)
{
  return {id, title, [change](const Scan& scan, Execution& execution) {
            Options options;
            options.remesher.rounds = 0;
            change(options, scan.spacing);
            const pcl::mrf::Reconstruction result = figures::reconstruct(scan, false, options, execution);
            const pcl::mrf::Report& report = result.report;
            return NoisyResult{figures::toSurfaceMesh(result), report.smoothingLength, report.smoothing.noise};
          }};
}

NoisyMethod defaultOnNoise()
{
  return oursOnNoise("default", "this (default)", [](Options&, double) {});
}

NoisyMethod voxelwiseOnNoise(pcl::mrf::ObservationKind kind, double beta)
{
  const std::string name = kind == pcl::mrf::ObservationKind::mean ? "mean" : "median";
  return oursOnNoise(name + "-" + text(beta), "this, voxel-wise " + name + ", k = 2, beta " + text(beta),
                     [kind, beta](Options& options, double) {
                       options.observation.kind = kind;
                       options.prior.kind = pcl::mrf::Prior::thinPlate;
                       options.prior.beta = static_cast<float>(beta);
                     });
}

NoisyMethod peerOnNoise(const Method& method)
{
  return {method.id, method.title, [method](const Scan& scan, Execution& execution) {
            return NoisyResult{method.run(withEstimatedNormals(scan, execution), scan.spacing, execution)};
          }};
}

NoisyMethod peerOnOurPoints(const Method& method)
{
  return {method.id + "-filtered", method.title + ", on the default's points",
          [method](const Scan& scan, Execution& execution) {
            pcl::mrf::Report report;
            const pcl::mrf::PointSet gathered = gather(figures::withoutNormals(scan), {}, report.points, execution);
            const auto search = pcl::mrf::makePointBins();
            const pcl::mrf::OrientedPoints oriented =
                pcl::mrf::preprocess(gathered, Options(), *search, report, execution);
            Points points;
            for (std::size_t i = 0; i < oriented.size(); ++i)
              add(points, oriented.positions[i].cast<double>() + oriented.offset, oriented.normals[i]);
            return NoisyResult{method.run(points, scan.spacing, execution)};
          }};
}

Points withEstimatedNormals(const Scan& scan, Execution& execution)
{
  pcl::mrf::PointCounts counts;
  const pcl::mrf::PointSet gathered = gather(figures::withoutNormals(scan), {}, counts, execution);
  const auto search = pcl::mrf::makePointBins();
  search->setPoints(gathered.positions);
  const std::vector<Eigen::Vector3f> normals =
      estimateNormals(gathered, *search, static_cast<float>(scan.spacing), {}, execution).normals;
  Points points;
  for (std::size_t i = 0; i < gathered.size(); ++i) {
    if (normals[i].isZero())
      continue;
    const auto view = static_cast<std::size_t>(gathered.views[i]);
    const bool facesSensor = normals[i].dot(gathered.sensors[view] - gathered.positions[i]) > 0;
    add(points, gathered.positions[i].cast<double>() + gathered.offset, facesSensor ? normals[i] : -normals[i]);
  }
  return points;
}

json measureNoisy(const NoisyMethod& method, const LoadedObject& object, const Scan& scan, Execution& execution)
{
  const Stopwatch watch;
  const NoisyResult result = method.run(scan, execution);
  const double seconds = watch.processorSeconds();
  if (!hasArea(result.mesh))
    throw pcl::mrf::InvalidInput("there is no surface");
  json measured = measureSurface(result.mesh, object, scan, execution);
  const auto inSpacings = [&](double length) { return length > 0 ? json(length / scan.spacing) : json(); };
  measured["smoothing"] = inSpacings(result.smoothing);
  measured["noise"] = inSpacings(result.noise);
  measured["processorSeconds"] = seconds;
  return measured;
}

} // namespace mrf_apps
