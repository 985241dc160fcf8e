// SPDX-License-Identifier: BSD-3-Clause
/// Cuts a mesh into parts that are remeshed one after the other, and makes strips along the cuts.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Part of each vertex; −1: it is in none.
using PartNumbers = std::vector<std::int32_t>;

/// Boxes with about the same number of positions. Each box is cut in two across its longest side until it is small
/// enough, so that seams are short. \param largest max number of positions in a box, > 0
PartNumbers cutIntoBoxes(const std::vector<Eigen::Vector3f>& positions, std::int64_t largest);

/// Strips of eight edges to both sides of the seams of parts, with their rims. Of strips that touch each other only one
/// is made, so that the function must be called again for the other seams. The first part's strip is always made.
/// \param seams part on whose seam a vertex is, or −1 \param largest number of vertices at which a strip stops to grow
PartNumbers stripsAlong(const PartNumbers& seams, const std::vector<Triangle>& triangles, std::int64_t largest);

/// Some triangles of a mesh with the vertices that they use.
struct MeshExtract {
  TriangleMesh mesh;
  std::vector<std::int32_t> vertices; ///< their numbers in the whole
};

/// Extracts triangles from a mesh, which must outlive this. Cost: linear in the number of these triangles.
class MeshExtractor {
public:
  explicit MeshExtractor(const TriangleMesh& mesh) : mesh_(mesh), places_(mesh.vertices.size(), -1) {}

  MeshExtract operator()(const std::vector<std::int32_t>& triangles);

private:
  const TriangleMesh& mesh_;
  std::vector<std::int32_t> places_; ///< of the vertices in the extract; −1 between calls
};

constexpr std::int32_t noGroup = -2; ///< of triangles that are ignored

enum class Pairs {
  all,
  acrossGroups ///< and some pairs within groups that cost nothing
};

/// selfIntersectingTriangles(), group by group of triangles, so that it takes memory for one group only.
/// \param groups of the triangles, ≥ 0; −1: tested against groups, but not against each other; or noGroup
std::vector<std::int32_t> intersectingInGroups(const TriangleMesh& mesh, const std::vector<std::int32_t>& groups,
                                               Pairs pairs, Execution& execution);

} // namespace pcl::mrf
