// SPDX-License-Identifier: BSD-3-Clause
/// Benchmarks of the stages that prepare the points.
#include "inputs.h"
#include "orientation/orientation.h"
#include "points/normals.h"
#include "points/outliers.h"
#include "points/sampling_density.h"

#include <pcl/surface/mrf/report.h>

#include <cmath>

using namespace benchmarks;
using namespace pcl::mrf;

namespace {

template <typename Stage>
void runOnPoints(benchmark::State& state, const Stage& stage)
{
  runStage(state, state.range(1), "point", static_cast<double>(state.range(0)), stage);
}

/// Mean angle to the true normal, up to sign, in degrees.
double angleError(const PointSet& points, const std::vector<Eigen::Vector3f>& normals)
{
  double sum = 0;
  for (std::size_t i = 0; i < normals.size(); ++i)
    sum += std::atan2(normals[i].cross(points.normals[i]).norm(), std::abs(normals[i].dot(points.normals[i])));
  return sum / static_cast<double>(normals.size()) * 180 / M_PI;
}

/// The nine nearest of each point by each search, which has to be built as well.
void nearest9(benchmark::State& state, SearchKind kind)
{
  const PointSet& points = inputOf<Cloud>(state.range(0)).points;
  runOnPoints(state, [&](Execution& execution) {
    const auto search = makeSearch(kind);
    search->setPoints(points.positions, execution);
    search->forEachPosition(points.positions, 9, NeighborSearch::Answer::indicesAndDistances, execution,
                            [&](const NeighborBatch& batch) { benchmark::DoNotOptimize(batch.squaredDistances[0]); });
  });
}

void density(benchmark::State& state)
{
  const Cloud& cloud = inputOf<Cloud>(state.range(0));
  SamplingDensity result;
  runOnPoints(state, [&](Execution& execution) {
    result = estimateSamplingDensity(cloud.points, measureNeighbors(cloud.points, *cloud.search, execution), execution);
  });
  // A spiral's points have the spacing of a square lattice, within a tenth.
  state.counters["error"] =
      std::abs(result.spacing / std::sqrt(4 * M_PI / static_cast<double>(cloud.points.size())) - 1);
}

void outliers(benchmark::State& state)
{
  const Cloud& cloud = inputOf<Cloud>(state.range(0));
  OutlierResult result;
  runOnPoints(state, [&](Execution& execution) {
    result = findOutliers(cloud.points, measureNeighbors(cloud.points, *cloud.search, execution), *cloud.search, {},
                          execution);
  });
  state.counters["error"] = static_cast<double>(result.droppedAlone); // there are none
}

void normals(benchmark::State& state)
{
  const Cloud& cloud = inputOf<Cloud>(state.range(0));
  NormalEstimates result;
  runOnPoints(state, [&](Execution& execution) {
    result = estimateNormals(cloud.points, *cloud.search, cloud.density.spacing, {}, execution);
  });
  state.counters["error_degrees"] = angleError(cloud.points, result.normals);
}

void orientation(benchmark::State& state)
{
  const Cloud& cloud = inputOf<Cloud>(state.range(0));
  // Every other normal is turned over.
  std::vector<Eigen::Vector3f> crossed = cloud.points.normals;
  for (std::size_t i = 0; i < crossed.size(); i += 2)
    crossed[i] = -crossed[i];
  OrientationResult result;
  runOnPoints(state, [&](Execution& execution) {
    result =
        orientNormals(cloud.points, crossed, *cloud.search, cloud.density, OrientationVote::outward, {}, execution);
  });
  double wrong = 0;
  for (std::size_t i = 0; i < result.normals.size(); ++i)
    wrong += result.normals[i].dot(cloud.points.normals[i]) > 0 ? 0 : 1;
  state.counters["error"] = wrong / static_cast<double>(result.normals.size());
}

void sizes(benchmark::internal::Benchmark* benchmark)
{
  configure(benchmark);
  benchmark->ArgNames({"points", "threads"})->ArgsProduct({{10000, 100000, 1000000}, {1, 2, 4}});
}

void searchSizes(benchmark::internal::Benchmark* benchmark)
{
  configure(benchmark);
  benchmark->ArgNames({"points", "threads"})->ArgsProduct({{35000, 1000000}, {1}});
}

} // namespace

BENCHMARK_CAPTURE(nearest9, bins, SearchKind::bins)->Apply(searchSizes);
BENCHMARK_CAPTURE(nearest9, kdtree, SearchKind::kdTree)->Apply(searchSizes);
BENCHMARK(density)->Apply(sizes);
BENCHMARK(outliers)->Apply(sizes);
BENCHMARK(normals)->Apply(sizes);
BENCHMARK(orientation)->Apply(sizes);
