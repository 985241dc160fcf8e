#include <pcl/surface/mrf/padding.h>

#include <pcl/surface/mrf/point_observation.h>
#include <pcl/surface/mrf/polygonizer.h>
#include <pcl/surface/mrf/triangle_mesh.h>
#include <pcl/surface/mrf/vertex_fields.h>

#include "mesh_topology.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace pcl {
namespace mrf {
namespace {

constexpr int pilotSide = 20; ///< voxels of the coarse solution along the points' longest side

/// Bounding box of the components of the mesh that some point supports.
BoundingBox supportedBox(const TriangleMesh& mesh)
{
  DisjointSets components(mesh.vertices.size());
  for (const Triangle& t : mesh.triangles) {
    components.unite(t[0], t[1]);
    components.unite(t[1], t[2]);
  }
  const auto componentOf = [&](std::size_t v) {
    return static_cast<std::size_t>(components.find(static_cast<std::int32_t>(v)));
  };
  std::vector<std::uint8_t> isSupported(mesh.vertices.size(), 0);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (mesh.confidences[v] > 0)
      isSupported[componentOf(v)] = 1;
  std::vector<Eigen::Vector3f> supported;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (isSupported[componentOf(v)])
      supported.push_back(mesh.vertices[v]);
  return boundingBox(supported);
}

} // namespace

int choosePadding(const OrientedPoints& points, const NeighbourSearch& search, float spacing,
                  const ObservationOptions& observation, const PriorOptions& prior, const SolverOptions& solver,
                  const MultiscaleOptions& multiscale, Execution& execution)
{
  const BoundingBox box = boundingBox(points.positions);
  const Eigen::Vector3f side = box.upper - box.lower;
  const float voxelSize = std::max(multiscale.voxelSize, side.maxCoeff() / pilotSide);

  MultiscaleOptions pilot = multiscale;
  pilot.voxelSize = voxelSize;
  pilot.padding = pilotSide / 2;
  ObservationOptions coarse = observation;
  coarse.smoothing = std::max(resolvedSmoothing(observation, spacing), leastSmoothing * voxelSize);
  coarse.maxDistance = std::max(resolvedMaxDistance(observation, spacing, voxelSize), 1.5f * voxelSize);
  const DistanceField field = regularise(points, search, spacing, coarse, prior, solver, pilot, execution).field;
  TriangleMesh mesh = polygonize(field, {}, execution);
  setConfidences(mesh, points, search, coarse.maxDistance, coarse.confidenceShape, execution);
  const BoundingBox surface = supportedBox(mesh);

  // A filled hole may bulge by a voxel of either grid; what goes on further is open.
  const float bulge = voxelSize + static_cast<float>(leastPadding - 2) * multiscale.voxelSize;
  const bool isOpen =
      ((box.lower - surface.lower).array() > bulge).any() || ((surface.upper - box.upper).array() > bulge).any();
  return isOpen ? leastPadding + static_cast<int>(std::ceil(side.minCoeff() / 2 / multiscale.voxelSize)) : leastPadding;
}

} // namespace mrf
} // namespace pcl
