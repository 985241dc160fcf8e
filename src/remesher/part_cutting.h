// SPDX-License-Identifier: BSD-3-Clause
/// Where a mesh is cut into parts to be remeshed one after the other, and what is around the cuts.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// The number of a part for each vertex; −1: it is in none.
using PartNumbers = std::vector<std::int32_t>;

/// Boxes with equally many positions, cut in two across their longest side again and again: seams are short.
/// \param largest number of positions in one, > 0
PartNumbers cutIntoBoxes(const std::vector<Eigen::Vector3f>& positions, std::int64_t largest);

/// Strips of eight edges to both sides of the seams of parts, and their rims. Those of parts beside each other are not
/// made at a time: what is left over is to be asked for again. Of the first part nothing is.
/// \param seams which part's seam a vertex is on \param largest number of vertices about which strips get no wider
PartNumbers stripsAlong(const PartNumbers& seams, const std::vector<Triangle>& triangles, std::int64_t largest);

/// Some triangles of a mesh with the vertices that they use.
struct MeshExtract {
  TriangleMesh mesh;
  std::vector<std::int32_t> vertices; ///< their numbers in the whole
};

/// Takes triangles from a mesh, which must outlive this, in a time that depends on them alone.
class MeshExtractor {
public:
  explicit MeshExtractor(const TriangleMesh& mesh) : mesh_(mesh), places_(mesh.vertices.size(), -1) {}

  MeshExtract operator()(const std::vector<std::int32_t>& triangles);

private:
  const TriangleMesh& mesh_;
  std::vector<std::int32_t> places_; ///< of the vertices in the extract; −1 between calls
};

constexpr std::int32_t noGroup = -2; ///< of triangles that are not looked at

enum class Pairs {
  all,
  acrossGroups ///< and some others, as far as they cost nothing
};

/// selfIntersectingTriangles(), group after group of triangles, so that it takes memory for one of them only.
/// \param groups of the triangles, 0 and up; −1: pairs of these alone are not looked at; or noGroup
std::vector<std::int32_t> intersectingInGroups(const TriangleMesh& mesh, const std::vector<std::int32_t>& groups,
                                               Pairs pairs, Execution& execution);

} // namespace pcl::mrf
