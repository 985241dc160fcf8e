// SPDX-License-Identifier: BSD-3-Clause
/// Finds intersecting triangles for the remesher, and pins vertices around them.
#pragma once

#include "mesh/crowded_space.h"
#include "remesher/half_edge_mesh.h"

#include <pcl/surface/mrf/execution.h>

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <vector>

namespace pcl::mrf {

/// Looks for intersecting triangles everywhere, or only where they are expected.
class IntersectionWatch {
public:
  enum class Place {
    everywhere,
    expected ///< on borders, parts of which may come to overlap, and where sheets are close or folded
  };

  /// \param mesh with normals \param edge target edge length, cloud's unit
  IntersectionWatch(Place place, const HalfEdgeMesh& mesh, float edge, Execution& execution);

  /// Where it looks. It is `everywhere` as well if intersections are expected in a large share of the mesh.
  Place place() const { return crowded_ ? Place::expected : Place::everywhere; }

  /// Indices of the watched triangles that intersect other watched ones.
  /// \param changed flags of vertices: pairs of triangles without a flagged corner are not tested. Empty: all pairs are
  std::vector<std::int32_t> intersectingTriangles(const HalfEdgeMesh& mesh, const std::vector<std::uint8_t>& changed,
                                                  Execution& execution) const;

  /// Looks where the mesh has changed since the last call. \return the changeable() triangles that intersect; from now
  /// on only these count as changed
  std::vector<std::int32_t> newIntersections(HalfEdgeMesh& mesh, Execution& execution) const;

private:
  std::vector<std::uint8_t> watchedVertices(const HalfEdgeMesh& mesh, Execution& execution) const;

  std::optional<CrowdedSpace> crowded_; ///< empty: everywhere
};

/// Those of the triangles that operations may have changed: all but those with three pinned corners, as no operation
/// makes or removes an edge between pinned vertices. If such a triangle intersects another one, that one has changed,
/// or they intersected in the input.
std::vector<std::int32_t> changeable(const HalfEdgeMesh& mesh, std::vector<std::int32_t> triangles);

/// Pins all vertices within a radius of a center, and some vertices within 2√3 times the radius.
void pinAround(const std::vector<Eigen::Vector3f>& centers, float radius, const std::vector<Eigen::Vector3f>& positions,
               std::vector<std::uint8_t>& pinned);

} // namespace pcl::mrf
