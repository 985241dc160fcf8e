// SPDX-License-Identifier: BSD-3-Clause
/// Benchmarks of the stages that make and improve the mesh.
#include "inputs.h"
#include "mesh/polygonizer.h"
#include "mesh/self_intersection.h"
#include "mesh/vertex_fields.h"
#include "remesher/remesher.h"
#include "support/clouds.h"
#include "support/shapes.h"
#include "trimming/trimming.h"

#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cmath>

using namespace benchmarks;
using namespace pcl::mrf;

namespace {

/// The exact field of the unit sphere and its zero level, with about the given number of triangles.
struct Surface {
  DistanceField field;
  TriangleMesh mesh;

  explicit Surface(std::int64_t triangles)
  {
    // Marching cubes gives three triangles per square of a voxel's side of a sphere's surface; three voxels are around
    // it.
    const double radiusInVoxels = std::sqrt(static_cast<double>(triangles) / (3 * 4 * M_PI));
    const int voxels = static_cast<int>(2 * radiusInVoxels) + 6;
    field = shapes::field(shapes::sphere(1), 1 / (1 - 6. / voxels), voxels);
    Execution execution(0);
    mesh = polygonize(field, execution);
  }

  double voxels(double length) const { return length / field.lattice().spacing; }
  double triangles() const { return static_cast<double>(mesh.triangles.size()); }
};

template <typename Stage>
void runOnTriangles(benchmark::State& state, const Surface& surface, const Stage& stage)
{
  runStage(state, state.range(1), "triangle", surface.triangles(), stage);
}

void polygonizer(benchmark::State& state)
{
  const Surface& surface = inputOf<Surface>(state.range(0));
  TriangleMesh result;
  runOnTriangles(state, surface, [&](Execution& execution) {
    result = TriangleMesh();
    result = polygonize(surface.field, execution);
  });
  state.counters["error_voxels"] = surface.voxels(sphereError(result));
}

void remesher(benchmark::State& state)
{
  const Surface& surface = inputOf<Surface>(state.range(0));
  const RemesherOptions options;
  RemeshResult result;
  runOnTriangles(state, surface, [&](Execution& execution) {
    result = RemeshResult();
    result = remesh(surface.mesh, surface.field, {}, options, execution);
  });
  // Seconds, so that the console prints it in microseconds.
  state.counters["per_triangle_round"] =
      benchmark::Counter(surface.triangles() * options.rounds,
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["error_voxels"] = surface.voxels(sphereError(result.mesh));
  state.counters["quality"] = measure(result.mesh).meanQuality;
}

void quality(benchmark::State& state)
{
  const Surface& surface = inputOf<Surface>(state.range(0));
  MeshStatistics result;
  runOnTriangles(state, surface, [&](Execution& execution) { result = measure(surface.mesh, execution); });
  state.counters["error"] = std::abs(result.area / (4 * M_PI) - 1);
}

void intersections(benchmark::State& state)
{
  const Surface& surface = inputOf<Surface>(state.range(0));
  std::size_t found = 0;
  runOnTriangles(state, surface,
                 [&](Execution& execution) { found = selfIntersectingTriangles(surface.mesh, execution).size(); });
  state.counters["error"] = static_cast<double>(found); // there are none
}

/// A tenth of the sphere without support.
void trimming(benchmark::State& state)
{
  const Surface& surface = inputOf<Surface>(state.range(0));
  TriangleMesh mesh = surface.mesh;
  Execution all(0);
  setNormals(mesh, surface.field, all);
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    mesh.confidences.push_back(vertex.z() < .8f ? 1.f : 0.f);
  const PointSet points = spherePoints(1000);
  const auto search = clouds::searchOf(points);
  OrientedPoints observed;
  observed.positions = points.positions;
  TrimmingOptions options;
  options.kind = Trimming::supported;
  TrimResult result;
  runOnTriangles(state, surface, [&](Execution& execution) {
    result = TrimResult();
    result = trim(mesh, observed, *search, 2, options, execution);
  });
  // A triangle that straddles the limit is supported.
  state.counters["error"] = std::abs(result.areaDropped / (4 * M_PI * .1) - 1);
}

void sizes(benchmark::internal::Benchmark* benchmark)
{
  configure(benchmark);
  benchmark->ArgNames({"triangles", "threads"})->ArgsProduct({{10000, 100000, 1000000}, {1, 2, 4}});
}

} // namespace

BENCHMARK(polygonizer)->Apply(sizes);
BENCHMARK(remesher)->Apply(sizes);
BENCHMARK(quality)->Apply(sizes);
BENCHMARK(intersections)->Apply(sizes);
BENCHMARK(trimming)->Apply(sizes);
