// SPDX-License-Identifier: BSD-3-Clause
// A whole run, from plain arrays and through the class for PCL's point types: both take what the stages take.
#include "inputs.h"
#include "support/clouds.h"
#include "support/conversion.h"

#include <pcl/surface/mrf_reconstruction.h>

#include <cmath>

using namespace benchmarks;
using namespace pcl::mrf;

namespace {

Options optionsOf(const benchmark::State& state)
{
  Options options;
  options.remesher.rounds = 0;
  options.threads = static_cast<int>(state.range(1));
  return options;
}

void addError(benchmark::State& state, const MeshStatistics& mesh)
{
  state.counters["error"] = std::abs(mesh.volume / (4 * M_PI / 3) - 1);
}

void stages(benchmark::State& state)
{
  const PointSet points = spherePoints(state.range(0));
  const Options options = optionsOf(state);
  Report report;
  runStage(state, options.threads, "point", static_cast<double>(points.size()), [&](Execution& execution) {
    report = reconstruct(clouds::raw(points.positions, points.normals), options, execution).report;
  });
  addError(state, report.mesh);
}

/// The cloud is its caller's; the mesh in PCL's layout counts.
void throughTheClass(benchmark::State& state)
{
  const PointSet points = spherePoints(state.range(0));
  pcl::MRFReconstruction<pcl::PointNormal> mrf;
  mrf.setInputCloud(conversion::make<pcl::PointNormal>(points));
  mrf.setOptions(optionsOf(state));
  runStage(state, 1, "point", static_cast<double>(points.size()), [&](Execution&) {
    pcl::PolygonMesh mesh;
    mrf.reconstruct(mesh);
  });
  addError(state, mrf.getReport().mesh);
}

void sizes(benchmark::internal::Benchmark* benchmark)
{
  configure(benchmark);
  benchmark->ArgNames({"points", "threads"})->ArgsProduct({{10000, 100000, 1000000}, {1, 2}});
}

} // namespace

BENCHMARK(stages)->Apply(sizes);
BENCHMARK(throughTheClass)->Apply(sizes);
