#include <pcl/surface/mrf/volume.h>

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

constexpr double pilotTolerance = .01; ///< of its solution, voxels

constexpr int pilotSide = 20; ///< voxels of the coarse solution along the points' longest side

constexpr float roomPerOpening = 1.2f; ///< around a vertex without data, in its distances to the nearest point

/// Flags the vertices of the components of the mesh that some point supports.
std::vector<std::uint8_t> supportedComponents(const TriangleMesh& mesh)
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
  std::vector<std::uint8_t> result(mesh.vertices.size(), 0);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    result[v] = isSupported[componentOf(v)];
  return result;
}

} // namespace

BoundingBox chooseVolume(const OrientedPoints& points, const NeighbourSearch& search, float spacing,
                         const ObservationOptions& observation, const PriorOptions& prior, const SolverOptions& solver,
                         const MultiscaleOptions& multiscale, Execution& execution)
{
  const BoundingBox box = boundingBox(points.positions);
  const Eigen::Vector3f side = box.upper - box.lower;
  MultiscaleOptions pilot = multiscale;
  pilot.voxelSize = std::max(multiscale.voxelSize, side.maxCoeff() / pilotSide);
  pilot.padding = pilotSide / 2;
  ObservationOptions coarse = observation;
  coarse.smoothing = std::max(resolvedSmoothing(observation, spacing), leastSmoothing * pilot.voxelSize);
  coarse.maxDistance = std::max(resolvedMaxDistance(observation, spacing, pilot.voxelSize), 1.5f * pilot.voxelSize);
  SolverOptions rough = solver;
  rough.changeTolerance = std::max(rough.changeTolerance, pilotTolerance);
  const DistanceField field = regularise(points, search, spacing, box, coarse, prior, rough, pilot, execution).field;
  TriangleMesh mesh = polygonize(field, {}, execution);
  setConfidences(mesh, points, search, coarse.maxDistance, coarse.confidenceShape, execution);

  BoundingBox volume = box;
  const std::vector<std::uint8_t> isSupported = supportedComponents(mesh);
  Neighbours nearest;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!isSupported[v] || mesh.confidences[v] > 0 || search.nearest(mesh.vertices[v], 1, nearest) < 1)
      continue;
    const float room = roomPerOpening * std::sqrt(nearest.squaredDistances[0]);
    volume.lower = volume.lower.cwiseMin((mesh.vertices[v].array() - room).matrix());
    volume.upper = volume.upper.cwiseMax((mesh.vertices[v].array() + room).matrix());
  }
  const float most = side.minCoeff() / 2;
  volume.lower = volume.lower.cwiseMax((box.lower.array() - most).matrix());
  volume.upper = volume.upper.cwiseMin((box.upper.array() + most).matrix());
  return volume;
}

} // namespace mrf
} // namespace pcl
