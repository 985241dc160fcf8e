// SPDX-License-Identifier: BSD-3-Clause
#include "pilot/volume.h"

#include "base/disjoint_sets.h"
#include "levels/multiscale.h"
#include "mesh/mesh_topology.h"
#include "mesh/polygonizer.h"
#include "mesh/vertex_fields.h"
#include "observation/observation.h"
#include "observation/point_observation.h"

#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <vector>

namespace pcl::mrf {
namespace {

/// changeTolerance of the coarse solution. Levels that observe points stop at 1.5 times toleranceAtPoints.
constexpr double toleranceAtPoints = 1. / 300, toleranceAtVoxels = 1.25e-3;

constexpr int pilotSide = 20; ///< voxels of the coarse solution along the points' longest side

constexpr float roomPerOpening = 1.2f; ///< ball around a vertex in an opening, in its distances to the nearest point

constexpr float beyondHole = 1.25f; ///< factor for maxHole, because the coarse solution shows sizes only roughly

/// Max width of the strip of sheet around an open surface, in voxels of the coarse solution, and of the finest level.
constexpr float coarseVoxelsAtRim = 2, voxelsAtRim = 20;

/// An opening is reliable if, for at least minAgreement of its vertices, the coarse solution has the normal of the
/// nearest point: the cosine is above agreeingCosine. It is wrong at parts thinner than its voxels, as a long corridor.
constexpr double minAgreement = .75;
constexpr float agreeingCosine = .5f;

/// A vertex is amid data if, seen along its normal, no sector wider than widestFreeSector radians is free of data. Data
/// are looked for within sightPerDistance times its distance to the nearest point.
constexpr double widestFreeSector = 150 * M_PI / 180;
constexpr float sightPerDistance = 3;

/// The connected openings: surface that no point supports, in the components of the mesh that some points support.
class Openings {
public:
  Openings(const TriangleMesh& mesh, const DistanceField& field, const OrientedPoints& points,
           const NeighborSearch& search)
      : mesh_(mesh), openingOf_(mesh.vertices.size())
  {
    const std::size_t count = mesh.vertices.size();
    DisjointSets components(count), openings(count);
    for (const Triangle& t : mesh.triangles)
      for (const std::size_t side : {0u, 1u, 2u}) {
        const std::int32_t a = t[side], b = t[(side + 1) % 3];
        components.join(a, b);
        if (isFree(a) && isFree(b))
          openings.join(a, b);
      }
    std::vector<std::uint8_t> hasPoints(count, 0);
    for (std::uint32_t v = 0; v < count; ++v)
      if (mesh.confidences[v] > 0)
        hasPoints[components.find(v)] = 1;
    distances_.assign(count, 0);
    largest_.assign(count, 0);
    reachesBorder_.assign(count, 0);
    vertices_.assign(count, 0);
    agreeing_.assign(count, 0);
    const VertexCorners corners = groupCorners(mesh);
    Ring ring;
    Neighbors nearest;
    for (std::uint32_t v = 0; v < count; ++v) {
      openingOf_[v] = openings.find(v);
      if (!isFree(static_cast<std::int32_t>(v)) || !hasPoints[components.find(v)] ||
          search.nearest(mesh.vertices[v], 1, nearest) < 1)
        continue;
      distances_[v] = std::sqrt(nearest.squaredDistances[0]);
      float& largest = largest_[openingOf_[v]];
      largest = std::max(largest, distances_[v]);
      const std::size_t p = nearest.indices[0];
      const Eigen::Vector3f gradient = field.sampleGradient(points.positions[p]);
      ++vertices_[openingOf_[v]];
      agreeing_[openingOf_[v]] += gradient.dot(points.normals[p]) > agreeingCosine * gradient.norm() ? 1 : 0;
      ring.set(mesh, corners, static_cast<std::int32_t>(v));
      if (!ring.isClosedFan())
        reachesBorder_[openingOf_[v]] = 1;
    }
  }

  /// Distance of a vertex in an opening to the nearest point, else 0.
  float distance(std::size_t v) const { return distances_[v]; }
  /// The largest distance in the opening of a vertex.
  float largest(std::size_t v) const { return largest_[openingOf_[v]]; }
  /// True if the opening of a vertex reaches the border of the coarse solution.
  bool reachesBorder(std::size_t v) const { return reachesBorder_[openingOf_[v]] != 0; }

  /// True if the coarse grid is fine enough for the surface around the opening of a vertex.
  bool isReliable(std::size_t v) const
  {
    const std::size_t opening = openingOf_[v];
    return static_cast<double>(agreeing_[opening]) >= minAgreement * static_cast<double>(vertices_[opening]);
  }

  /// True if data are all around a vertex.
  bool isAmidData(std::size_t v, const Eigen::Vector3f& normal) const
  {
    const Eigen::Vector3f u = normal.unitOrthogonal(), w = normal.cross(u);
    const float sight = sightPerDistance * distances_[v];
    std::vector<double> angles;
    for (std::size_t d = 0; d < mesh_.vertices.size(); ++d) {
      const Eigen::Vector3f to = mesh_.vertices[d] - mesh_.vertices[v];
      if (mesh_.confidences[d] > 0 && to.squaredNorm() <= sight * sight)
        angles.push_back(std::atan2(w.dot(to), u.dot(to)));
    }
    if (angles.empty())
      return false;
    std::sort(angles.begin(), angles.end());
    double widest = angles.front() + 2 * M_PI - angles.back();
    for (std::size_t n = 1; n < angles.size(); ++n)
      widest = std::max(widest, angles[n] - angles[n - 1]);
    return widest <= widestFreeSector;
  }

private:
  bool isFree(std::int32_t v) const { return !(mesh_.confidences[v] > 0); }
  const TriangleMesh& mesh_;
  std::vector<std::size_t> openingOf_; ///< representative vertex of each vertex's opening
  std::vector<float> distances_, largest_;
  std::vector<std::uint8_t> reachesBorder_;
  std::vector<std::int32_t> vertices_, agreeing_; ///< per opening: all, and those whose nearest point agrees
};

} // namespace

BoundingBox chooseVolume(const OrientedPoints& points, const NeighborSearch& search, float spacing,
                         const Options& options, float maxHole, Execution& execution)
{
  const BoundingBox box = boundingBox(points.positions);
  const Eigen::Vector3f side = box.upper - box.lower;
  Options pilot = options;
  const float pilotVoxel = std::max(options.multiscale.voxelSize, side.maxCoeff() / pilotSide);
  pilot.multiscale.voxelSize = pilotVoxel;
  pilot.multiscale.padding = pilotSide / 2;
  ObservationOptions& observation = pilot.observation;
  observation.smoothing = static_cast<float>(levelSmoothing(options.observation, spacing, pilotVoxel, false));
  observation.maxDistance = std::max(resolvedMaxDistance(options.observation, spacing, pilotVoxel), 1.5f * pilotVoxel);
  pilot.solver.changeTolerance =
      std::max(pilot.solver.changeTolerance, observation.atPoints() ? toleranceAtPoints : toleranceAtVoxels);
  const DistanceField field = regularize({&points, &search, box}, spacing, pilot, execution).field;
  TriangleMesh mesh = polygonize(field, execution);
  setConfidences(mesh, {points, search, observation.maxDistance, 0}, observation.confidenceShape, execution);

  setNormals(mesh, field, execution);

  BoundingBox volume = box, rim = box;
  const auto grow = [](BoundingBox& grown, const Eigen::Vector3f& center, float room) {
    grown.lower = grown.lower.cwiseMin((center.array() - room).matrix());
    grown.upper = grown.upper.cwiseMax((center.array() + room).matrix());
  };
  const auto limit = [&](BoundingBox& grown, float max) {
    grown.lower = grown.lower.cwiseMax((box.lower.array() - max).matrix());
    grown.upper = grown.upper.cwiseMin((box.upper.array() + max).matrix());
  };
  const Openings openings(mesh, field, points, search);
  const float farthest = beyondHole * maxHole / 2;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const float distance = openings.distance(v);
    const auto isInOpening = [&] {
      return openings.reachesBorder(v) ? distance <= farthest && openings.isAmidData(v, mesh.normals[v])
                                       : openings.largest(v) <= farthest;
    };
    if (distance == 0)
      continue;
    if (openings.isReliable(v) && isInOpening())
      grow(volume, mesh.vertices[v], roomPerOpening * distance);
    else if (distance <= coarseVoxelsAtRim * pilotVoxel)
      grow(rim, mesh.vertices[v], roomPerOpening * distance);
  }
  limit(volume, side.maxCoeff() / 2);
  limit(rim, voxelsAtRim * options.multiscale.voxelSize);
  volume.lower = volume.lower.cwiseMin(rim.lower);
  volume.upper = volume.upper.cwiseMax(rim.upper);
  return volume;
}

} // namespace pcl::mrf
