// SPDX-License-Identifier: BSD-3-Clause
/// Where the remesher looks for triangles that intersect, and what it leaves alone around them.
#pragma once

#include "mesh/crowded_space.h"
#include "remesher/half_edge_mesh.h"

#include <pcl/surface/mrf/execution.h>

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <vector>

namespace pcl::mrf {

/// Looks for intersections everywhere, or only where they are to be expected.
class IntersectionWatch {
public:
  enum class Place {
    everywhere,
    expected ///< on the border, where two parts of it may come to overlap, and where sheets are close or folded
  };

  /// \param mesh with normals \param edge that is aimed at, cloud's unit
  IntersectionWatch(Place place, const HalfEdgeMesh& mesh, float edge, Execution& execution);

  /// Where it looks: everywhere as well if that is hardly more than what is expected.
  Place place() const { return crowded_ ? Place::expected : Place::everywhere; }

  /// Numbers of the triangles that intersect others, of those that are watched.
  /// \param changed vertices; pairs of triangles without any are not looked at. Empty: all
  std::vector<std::int32_t> intersectingTriangles(const HalfEdgeMesh& mesh, const std::vector<std::uint8_t>& changed,
                                                  Execution& execution) const;

  /// Looks where the mesh has changed since the last look. \return triangles that intersect there and may be changed;
  /// from now on those alone count as changed
  std::vector<std::int32_t> newIntersections(HalfEdgeMesh& mesh, Execution& execution) const;

private:
  std::vector<std::uint8_t> watchedVertices(const HalfEdgeMesh& mesh, Execution& execution) const;

  std::optional<CrowdedSpace> crowded_; ///< without: everywhere
};

/// Those of some triangles that operations may have changed: none makes or removes an edge between pinned vertices, so
/// one with three pinned corners is the same as before. What intersects it has changed, or the intersection is the
/// input's own.
std::vector<std::int32_t> changeable(const HalfEdgeMesh& mesh, std::vector<std::int32_t> triangles);

/// Pins what is within a radius of one of the centers, and some of what is within 2√3 times as much.
void pinAround(const std::vector<Eigen::Vector3f>& centers, float radius, const std::vector<Eigen::Vector3f>& positions,
               std::vector<std::uint8_t>& pinned);

} // namespace pcl::mrf
