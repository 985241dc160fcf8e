// SPDX-License-Identifier: BSD-3-Clause
#include "benchmark/heap.h"
#include "field/prior.h"
#include "levels/level_memory.h"
#include "levels/multiscale.h"
#include "observation/observation.h"
#include "support/clouds.h"
#include "support/conversion.h"
#include "support/shapes.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf_reconstruction.h>

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <string>
#include <tuple>

using namespace pcl::mrf;

namespace {

constexpr double radius = 1, area = 4 * M_PI * radius * radius;

/// A run on a sphere whose points are about as far apart as a voxel's side.
struct SphereRun {
  OrientedPoints points;
  std::unique_ptr<NeighborSearch> search = makePointBins();
  float spacing = 0;
  Options options;
  int threads = 1;

  explicit SphereRun(double voxelsPerDiameter)
  {
    options.multiscale.voxelSize = static_cast<float>(2 * radius / voxelsPerDiameter);
    points = shapes::oriented(
        shapes::sample(shapes::sphere(radius), 1.2 * radius, static_cast<double>(options.multiscale.voxelSize)));
    spacing = static_cast<float>(.5 * std::sqrt(area / static_cast<double>(points.size())));
    options.observation.smoothing = spacing / 2;
    search->setPoints(points.positions);
    options.solver.maxIterations = 2; // memory is the same for any number
  }

  double predicted() const
  {
    Workload workload;
    workload.area = area;
    workload.points = static_cast<double>(points.size());
    const float reach = resolvedMaxDistance(options.observation, spacing, options.multiscale.voxelSize);
    workload.reach = options.observation.atPoints() ? 0 : reach;
    workload.prior = options.prior;
    workload.solver = options.solver;
    return predictedBytes(boundingBox(points.positions), options.multiscale.voxelSize, workload, options.multiscale,
                          threads);
  }

  /// Peak bytes of the heap, beside what was taken before.
  double measured() const
  {
    Execution execution(threads);
    const std::int64_t before = benchmarks::heapBytes();
    benchmarks::resetPeak();
    regularize({&points, search.get(), boundingBox(points.positions)}, spacing, options, execution);
    return static_cast<double>(benchmarks::peakBytes() - before);
  }

  std::string name() const
  {
    return "method " + std::to_string(static_cast<int>(options.solver.method)) +
           ", k = " + std::to_string(order(options.prior.kind)) + ", energy " +
           std::to_string(static_cast<int>(options.prior.energy)) + ", " + std::to_string(threads) + " threads, " +
           (options.observation.atPoints() ? "points" : "voxels");
  }
};

/// The promised accuracy. Arrays are counted; the numbers of occupied and observed voxels are estimated from the area.
constexpr double tolerance = .15;

void expectPredicted(const SphereRun& run)
{
  const double predicted = run.predicted();
  const double measured = run.measured();
  EXPECT_NEAR(predicted / measured, 1, tolerance) << run.name() << ": " << measured / 1e6 << " MB";
}

} // namespace

class EverySolver : public testing::TestWithParam<std::tuple<SolverMethod, Prior, int>> {};

TEST_P(EverySolver, TakesWhatWasPredictedOn100000Voxels)
{
  SphereRun run(35);
  run.options.multiscale.denseVoxels = std::int64_t{1} << 40;
  std::tie(run.options.solver.method, run.options.prior.kind, run.threads) = GetParam();
  for (const auto& [kind, energy] :
       {std::pair(ObservationKind::points, Energy::joint), std::pair(ObservationKind::median, Energy::joint),
        std::pair(ObservationKind::plane, Energy::paper)}) {
    run.options.observation.kind = kind;
    run.options.prior.energy = energy;
    expectPredicted(run);
  }
}

INSTANTIATE_TEST_SUITE_P(Memory, EverySolver,
                         testing::Combine(testing::Values(SolverMethod::multigrid, SolverMethod::icm, SolverMethod::cg),
                                          testing::Values(Prior::membrane, Prior::thinPlate, Prior::triharmonic),
                                          testing::Values(1, 2)));

TEST(Memory, BandsTakeWhatWasPredicted)
{
  SphereRun run(178); // 100,000 points
  for (const Prior prior : {Prior::membrane, Prior::thinPlate, Prior::triharmonic})
    for (const ObservationKind kind : {ObservationKind::points, ObservationKind::plane}) {
      run.threads = prior == Prior::thinPlate ? 2 : 1;
      run.options.prior.kind = prior;
      run.options.observation.kind = kind;
      expectPredicted(run);
    }
}

TEST(Memory, WhatDoesNotFitIsRefusedBeforeItIsTaken)
{
  SphereRun run(60);
  run.options.multiscale.denseVoxels = std::int64_t{1} << 40;
  for (const SolverMethod method :
       {SolverMethod::multigrid, SolverMethod::icm, SolverMethod::cg, SolverMethod::cholesky}) {
    run.options.solver.method = method;
    run.options.multiscale.maxMemory = static_cast<std::size_t>(.9 * run.predicted());
    const std::int64_t before = benchmarks::heapBytes();
    benchmarks::resetPeak();
    const std::string message = clouds::messageOf<ResourceLimit>([&] { run.measured(); });
    EXPECT_NE(message.find("a voxel size of"), std::string::npos) << message;
    EXPECT_LT(benchmarks::peakBytes() - before, 1 << 20) << run.name();
    run.options.multiscale.maxMemory = std::size_t{1} << 40; // not what is short below
  }
}

TEST(Memory, TheClassTakesWhatTheStagesTake)
{
  const PointSet points = shapes::sample(shapes::sphere(1), 1.2, .0112); // 100,000
  Options options;
  options.remesher.rounds = 0;
  options.threads = 2;
  const auto peakOf = [](const auto& run) {
    const std::int64_t before = benchmarks::heapBytes();
    benchmarks::resetPeak();
    run();
    return static_cast<double>(benchmarks::peakBytes() - before);
  };
  std::int64_t triangles = 0;
  const double stages = peakOf([&] {
    Execution execution(options.threads);
    const Reconstruction result = reconstruct(clouds::raw(points.positions, points.normals), options, execution);
    triangles = result.report.mesh.triangles;
  });
  // What the caller holds is no cost of either.
  pcl::MRFReconstruction<pcl::PointNormal> mrf;
  mrf.setInputCloud(conversion::make<pcl::PointNormal>(points));
  mrf.setOptions(options);
  pcl::PolygonMesh mesh;
  const double ofClass = peakOf([&] { mrf.reconstruct(mesh); });
  ASSERT_EQ(static_cast<std::int64_t>(mesh.polygons.size()), triangles);
  std::cout << points.size() << " points: stages " << stages / 1e6 << " MB, class " << ofClass / 1e6 << " MB\n";
  EXPECT_LT(ofClass, 1.1 * stages);

  // Afterwards there is the output, of whose many small arrays each takes twice its size. Field, points and a second
  // mesh would be three times as much.
  const double output =
      static_cast<double>(mesh.cloud.data.capacity() + mesh.polygons.capacity() * sizeof(pcl::Vertices)) +
      static_cast<double>(mesh.polygons.size() * 2 * 3 * sizeof(pcl::index_t));
  mesh = pcl::PolygonMesh();
  const std::int64_t before = benchmarks::heapBytes();
  mrf.reconstruct(mesh);
  EXPECT_LT(static_cast<double>(benchmarks::heapBytes() - before), 1.1 * output);
  mesh = pcl::PolygonMesh();
  mrf.setKeepResult(true);
  mrf.reconstruct(mesh);
  EXPECT_GT(static_cast<double>(benchmarks::heapBytes() - before), 2 * output) << "what it was asked to keep";
}

TEST(Memory, TilesTakeWhatWasPredictedAndLess)
{
  SphereRun run(178);
  run.options.multiscale.denseVoxels = 1 << 17;
  run.options.solver.maxIterations = 1; // several steps are not taken in tiles
  const double whole = run.predicted();
  run.options.multiscale.maxMemory = static_cast<std::size_t>(.8 * whole);
  EXPECT_NEAR(run.measured() / whole, .8, tolerance);
}
