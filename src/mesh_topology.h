/// \file
/// \brief Adjacency of triangle meshes: which triangles share an edge, which corners form one fan.
#pragma once

#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

/// Disjoint sets of 0..count-1 whose representative is the smallest member, so that it depends on nothing else.
class DisjointSets {
public:
  explicit DisjointSets(std::size_t count);

  std::int32_t find(std::int32_t element);
  void unite(std::int32_t a, std::int32_t b);

private:
  std::vector<std::int32_t> parent_;
};

/// Side s = 3 t + c of a mesh leads from corner c of triangle t to the next one; corners are numbered alike.
inline std::int32_t nextCorner(std::int32_t corner)
{
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

inline std::int32_t vertexAt(const TriangleMesh& mesh, std::int32_t corner)
{
  return mesh.triangles[static_cast<std::size_t>(corner / 3)][static_cast<std::size_t>(corner % 3)];
}

/// True if the three indices name three different vertices of the mesh.
bool hasValidIndices(const TriangleMesh& mesh, std::size_t triangle);

/// The sides of all triangles with valid indices, grouped by the edge they lie on.
struct EdgeSides {
  std::vector<std::int32_t> sides; ///< edge by edge; ascending within an edge
  std::vector<std::int32_t> begin; ///< edge e owns sides[begin[e]] .. sides[begin[e + 1]]

  std::size_t count() const { return begin.size() - 1; }
  std::int32_t sidesOf(std::size_t edge) const { return begin[edge + 1] - begin[edge]; }
  /// The n-th side of an edge.
  std::int32_t side(std::size_t edge, std::int32_t n) const { return sides[static_cast<std::size_t>(begin[edge] + n)]; }
};

/// Groups sides in linear time (for bounded valences). Edges are in the order of their smaller, then larger vertex.
/// \throw ResourceLimit if the mesh has too many triangles for 32-bit side numbers
EdgeSides groupSides(const TriangleMesh& mesh);

/// Unites the triangles that share an edge and are both members.
DisjointSets groupTriangles(const EdgeSides& edges, const std::vector<std::uint8_t>& isMember);

/// Unites the corners at the two ends of each edge that has exactly two sides: what remains apart are separate fans.
DisjointSets groupFans(const TriangleMesh& mesh, const EdgeSides& edges);

/// Gives each fan of triangles around a vertex a vertex of its own, so that no two fans meet in a point. The fan of the
/// first triangle keeps the vertex; copies, with all per-vertex arrays, are appended.
void splitFans(TriangleMesh& mesh);

} // namespace mrf
} // namespace pcl
