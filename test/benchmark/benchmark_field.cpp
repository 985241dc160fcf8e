// SPDX-License-Identifier: BSD-3-Clause
/// Benchmarks of the regularization, and of the smoother's memory bandwidth.
#include "inputs.h"
#include "levels/multiscale.h"
#include "mesh/polygonizer.h"
#include "solver/grids.h"
#include "support/shapes.h"

#include <pcl/surface/mrf/options.h>

#include <chrono>
#include <vector>

using namespace benchmarks;
using namespace pcl::mrf;

namespace {

/// All levels.
void regularization(benchmark::State& state, ObservationKind kind, const Cloud& cloud, float voxelSize,
                    std::int64_t threads)
{
  const auto count = static_cast<double>(cloud.points.size());
  const OrientedPoints points = shapes::oriented(cloud.points);
  Options options;
  options.observation.kind = kind;
  options.prior.kind = static_cast<Prior>(state.range(1));
  options.multiscale.voxelSize = voxelSize;
  options.multiscale.padding = minPadding;
  const SolvedPiece piece{&points, cloud.search.get(), boundingBox(points.positions)};
  MultiscaleResult result;
  runStage(state, threads, "point", count, [&](Execution& execution) {
    result = MultiscaleResult();
    result = regularize(piece, cloud.density.spacing, options, execution);
  });
  state.counters["predicted/taken"] =
      static_cast<double>(result.predictedBytes) / (state.counters["bytes/point"].value * count);
  Execution execution(0);
  state.counters["voxels"] = static_cast<double>(result.levels.back().size.count());
  state.counters["error_voxels"] =
      sphereError(polygonize(result.field, execution)) / static_cast<double>(options.multiscale.voxelSize);
}

/// At the default voxel size.
void byPoints(benchmark::State& state, ObservationKind kind)
{
  const Cloud& cloud = inputOf<Cloud>(state.range(0));
  const float voxelSize = spacingsPerVoxel(MultiscaleOptions().quality) * cloud.density.spacing;
  regularization(state, kind, cloud, voxelSize, state.range(2));
}

/// A volume of 150³ voxels around 221,000 points of a sphere, as in the paper's example; the median of five planes.
void volume150(benchmark::State& state)
{
  constexpr float radius = 1;
  const float voxelSize = 2 * radius / (150 - 2 * minPadding);
  const ObservationKind kind = state.range(0) == 0 ? ObservationKind::points : ObservationKind::median;
  regularization(state, kind, inputOf<Cloud>(221000), voxelSize, 1);
}

/// Bytes per second of a triad over arrays of the size of the field, the best of several runs.
double triadBandwidth(std::size_t count, Execution& execution)
{
  std::vector<float> a(count), b(count, 1), c(count, 2);
  double best = 0;
  for (int run = 0; run < 5; ++run) {
    const auto start = std::chrono::steady_clock::now();
    execution.forRange(static_cast<std::int64_t>(count), 1 << 16, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t i = begin; i < end; ++i)
        a[static_cast<std::size_t>(i)] = b[static_cast<std::size_t>(i)] + 3 * c[static_cast<std::size_t>(i)];
    });
    benchmark::DoNotOptimize(a.data());
    benchmark::ClobberMemory();
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    best = std::max(best, 3 * sizeof(float) * static_cast<double>(count) / seconds);
  }
  return best;
}

/// The smoother from zero, with the residual after it. `streamed` is the number of bytes that its steps would move one
/// by one: 16 bytes per voxel for the first (b, D⁻¹ → x, z), 28 for each other (x, w, b, D⁻¹, z → x, z), 16 for the
/// residual (x, w, b → r).
void smoother(benchmark::State& state)
{
  const auto side = static_cast<int>(std::lround(std::cbrt(static_cast<double>(state.range(0)))));
  const GridSize size{side, side, side};
  const auto count = static_cast<std::size_t>(size.count());
  const auto prior = static_cast<Prior>(state.range(1));
  const PriorConstants constants = priorConstants(prior, true);
  const int degree = constants.degree;
  Execution execution(static_cast<int>(state.range(2)));
  SolverGrid grid;
  grid.isWhole = true;
  grid.voxels = wholeOf({size, Eigen::Vector3d::Zero(), 1}, execution);
  grid.data = makeVoxelData(grid.voxels, std::vector<float>(count, 1), std::vector<float>(count, 1));

  const double triad = triadBandwidth(count, execution);
  GridOperator system(grid, constants, 0, execution);
  std::vector<SweepScratch> scratch(static_cast<std::size_t>(execution.threads()));
  PackedValues b, x(count), residual(count);
  sumRightHandSide(grid, nullptr, b, execution);
  Sweep sweep;
  sweep.source = Sweep::Source::zero;
  sweep.b = b.data();
  sweep.out = x.data();
  sweep.product = residual.data();
  system.smooth(sweep, degree, scratch, execution); // its memory is there from now on
  const auto start = std::chrono::steady_clock::now();
  for (auto _ : state)
    system.smooth(sweep, degree, scratch, execution);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const double voxels = static_cast<double>(count) * static_cast<double>(state.iterations());
  const double streamed = (16 + 28 * (degree - 1) + 16) * voxels;
  state.counters["voxels"] = benchmark::Counter(voxels, benchmark::Counter::kIsRate);
  state.counters["GB/s"] = streamed / seconds * 1e-9;
  state.counters["triad_GB/s"] = triad * 1e-9;
  state.counters["share"] = streamed / seconds / triad;
}

void sizes(benchmark::internal::Benchmark* benchmark)
{
  configure(benchmark);
  benchmark->ArgNames({"points", "k", "threads"})
      ->ArgsProduct({{10000, 100000, 1000000, 3000000}, {1, 2, 3}, {1, 2, 4}});
}

} // namespace

BENCHMARK_CAPTURE(byPoints, pointWise, ObservationKind::points)->Apply(sizes);
BENCHMARK_CAPTURE(byPoints, voxelWise, ObservationKind::plane)->Apply(sizes);
BENCHMARK(volume150)->Apply(configure)->ArgNames({"voxelwise", "k"})->ArgsProduct({{0, 1}, {1, 2, 3}});
BENCHMARK(smoother)
    ->Apply(configure)
    ->ArgNames({"voxels", "k", "threads"})
    ->ArgsProduct({{10000, 10077696}, {1, 2, 3}, {1, 2}});
