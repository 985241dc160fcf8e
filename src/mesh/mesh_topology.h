// SPDX-License-Identifier: BSD-3-Clause
/// Adjacency of triangle meshes: which triangles share an edge, which corners form one fan.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include "base/disjoint_sets.h"
#include "base/loops.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <limits>
#include <vector>

namespace pcl::mrf {

/// True if the three indices name three different vertices of the mesh.
inline bool hasValidIndices(const TriangleMesh& mesh, std::size_t triangle)
{
  const Triangle& t = mesh.triangles[triangle];
  const auto inside = [&](std::int32_t v) { return v >= 0 && static_cast<std::size_t>(v) < mesh.vertices.size(); };
  return inside(t[0]) && inside(t[1]) && inside(t[2]) && t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
}

/// \pre hasValidIndices
inline double areaOf(const TriangleMesh& mesh, const Triangle& corners)
{
  const Eigen::Vector3d a = mesh.vertices[corners[0]].cast<double>(), b = mesh.vertices[corners[1]].cast<double>(),
                        c = mesh.vertices[corners[2]].cast<double>();
  return (b - a).cross(c - a).norm() / 2;
}

/// Calls body(t) for all triangles, concurrently.
template <typename Body>
void forTriangles(const TriangleMesh& mesh, Execution& execution, const Body& body)
{
  constexpr std::int64_t grain = 16384;
  forEach(execution, mesh.triangles.size(), grain, [&](std::size_t t) { body(t); });
}

/// The corners at each vertex of a range: corner 3 t + i is the i-th of triangle t.
struct VertexCorners {
  std::vector<std::int32_t> begin;   ///< vertex first + n owns corners[begin[n]] .. corners[begin[n + 1]]
  std::vector<std::int32_t> corners; ///< ascending within a vertex
  std::int32_t first = 0;            ///< of the range
};

/// Groups the corners of the triangles that have valid indices and, unless the flags are empty, a flag that is set.
/// \param first, count of the vertices that are asked for \throw ResourceLimit if the mesh has too many triangles for
/// 32-bit corner numbers
VertexCorners groupCorners(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isMember = {},
                           std::size_t first = 0, std::size_t count = std::numeric_limits<std::size_t>::max());

/// The triangles around one vertex, and the edges between them that end there.
///
/// Every triangle of the ring has two sides at the vertex: one that starts there (outgoing) and one that ends there.
/// Sides that lead to the same vertex lie on one edge. Meant to be reused from vertex to vertex.
class Ring {
public:
  struct Side {
    std::int32_t to; ///< vertex at the other end
    std::int32_t at; ///< number of its triangle in the ring
    bool isOutgoing;
  };
  /// Sides on one edge: ascending by their triangles.
  struct Edge {
    const Side* begin;
    const Side* end;
    std::int32_t to() const { return begin->to; }
    std::int32_t sides() const { return static_cast<std::int32_t>(end - begin); }
  };

  void set(const TriangleMesh& mesh, const VertexCorners& corners, std::int32_t vertex);

  std::int32_t size() const { return static_cast<std::int32_t>(following_.size()); }
  std::int32_t corner(std::int32_t i) const { return corners_[i]; }
  /// The vertex that follows in triangle i: over all triangles of a closed fan, every neighbor once.
  std::int32_t following(std::int32_t i) const { return following_[i]; }
  /// The side's number: that of the corner it starts from.
  std::int32_t sideNumber(const Side& side) const;

  /// True if the triangles form one closed fan of at most 32 with one orientation: then nothing else needs a look.
  bool isClosedFan() const { return isClosedFan_; }

  /// Finds the edges; needed by what follows. Cost: n log n.
  void findEdges();
  const std::vector<Edge>& edges() const { return edges_; }

  /// Joins triangles over edges with two sides, or over those with more as well. \return the number of fans
  std::int32_t joinFans(bool overCrowdedEdges);
  /// The first triangle of the fan that triangle i belongs to. \pre joinFans
  std::int32_t fan(std::int32_t i) const { return fans_[i]; }

private:
  bool closes() const;
  std::int32_t findFan(std::int32_t i) const;

  bool isClosedFan_ = false;
  const std::int32_t* corners_ = nullptr;
  std::vector<std::int32_t> following_, preceding_, fans_;
  std::vector<Side> sides_;
  std::vector<Edge> edges_;
};

/// Calls body(part, ring, vertex) for all vertices; each range of them has a part of its own. \param isMember triangles
/// of the rings: all, if there are no flags \param atATime vertices whose corners are grouped: those of all take more
/// memory than the mesh \return the parts, in the order of the ranges \throw ResourceLimit as groupCorners; Cancelled
template <typename Part, typename Body>
std::vector<Part> partsOfRings(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isMember,
                               Execution& execution, const Body& body, std::size_t atATime = std::size_t{1} << 21)
{
  constexpr std::int64_t grain = 16384;
  std::vector<Part> parts;
  for (std::size_t first = 0; first < mesh.vertices.size(); first += atATime) {
    const VertexCorners corners = groupCorners(mesh, isMember, first, atATime);
    std::vector<Part> some = partsOf<Part, std::int32_t>(
        execution, corners.begin.size() - 1, grain, [&](Part& part, std::int32_t begin, std::int32_t end) {
          Ring ring;
          for (std::int32_t v = corners.first + begin; v < corners.first + end; ++v) {
            ring.set(mesh, corners, v);
            body(part, ring, v);
          }
        });
    std::move(some.begin(), some.end(), std::back_inserter(parts));
  }
  return parts;
}

/// Joins the triangles of a ring that hang together over shared edges. May be called concurrently.
/// \pre the ring has its edges unless it is a closed fan
void joinTriangles(Ring& ring, DisjointSets& triangles);

/// The component of each triangle with valid indices and, unless the flags are empty, a flag that is set: components
/// are numbered by their first triangle, −1 for others. \param triangles joined ring by ring \return how many there are
std::int32_t numberComponents(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isMember,
                              DisjointSets& triangles, Execution& execution,
                              std::vector<std::int32_t>& componentOfTriangle);

/// Components of the member triangles (all, if there are no flags) over shared edges.
/// \param isTorn receives whether the members around some vertex fall into several fans
std::int32_t groupTriangles(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isMember, Execution& execution,
                            std::vector<std::int32_t>& componentOfTriangle, bool& isTorn);

/// Gives each fan of triangles around a vertex a vertex of its own, so that no two fans meet in a point. The fan of the
/// first triangle keeps the vertex; copies, with all per-vertex arrays, are appended.
void splitFans(TriangleMesh& mesh);

} // namespace pcl::mrf
