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

/// The positions of a triangle's corners in double precision.
struct TriangleCorners {
  Eigen::Vector3d a, b, c;

  TriangleCorners(const Eigen::Vector3f& first, const Eigen::Vector3f& second, const Eigen::Vector3f& third)
      : a(first.cast<double>()), b(second.cast<double>()), c(third.cast<double>())
  {}
  /// \pre hasValidIndices
  TriangleCorners(const TriangleMesh& mesh, const Triangle& t)
      : TriangleCorners(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]])
  {}

  /// The normal; its length is twice the area.
  Eigen::Vector3d cross() const { return (b - a).cross(c - a); }
  double area() const { return cross().norm() / 2; }
};

/// \pre hasValidIndices
inline double areaOf(const TriangleMesh& mesh, const Triangle& corners)
{
  return TriangleCorners(mesh, corners).area();
}

/// Calls body(t) for all triangles, concurrently.
template <typename Body>
void forTriangles(const TriangleMesh& mesh, Execution& execution, const Body& body)
{
  constexpr std::int64_t grain = 16384;
  forEach(execution, mesh.triangles.size(), grain, body);
}

/// The corners at each vertex of a range: corner 3 t + i is the i-th of triangle t.
struct VertexCorners {
  std::vector<std::int32_t> begin;   ///< vertex first + n owns corners[begin[n]] .. corners[begin[n + 1] - 1]
  std::vector<std::int32_t> corners; ///< ascending within a vertex
  std::int32_t first = 0;            ///< first vertex of the range
};

/// Groups the corners of triangles by vertex, without triangles that have invalid indices.
/// \param isMember flags of the triangles to use; empty: all \param first, count range of the vertices
/// \throw ResourceLimit if the mesh has too many triangles for 32-bit corner numbers
VertexCorners groupCorners(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isMember = {},
                           std::size_t first = 0, std::size_t count = std::numeric_limits<std::size_t>::max());

/// The triangles around one vertex, and their edges that end there.
///
/// Every triangle of the ring has two sides at the vertex: one that starts there (outgoing) and one that ends there.
/// Sides with the same other end lie on one edge. One object should be reused for many vertices.
class Ring {
public:
  struct Side {
    std::int32_t to; ///< vertex at the other end
    std::int32_t at; ///< number of its triangle in the ring
    bool isOutgoing;
  };
  /// The sides on one edge, sorted by triangle.
  struct Edge {
    const Side* begin;
    const Side* end;
    std::int32_t to() const { return begin->to; }
    std::int32_t sides() const { return static_cast<std::int32_t>(end - begin); }
  };

  void set(const TriangleMesh& mesh, const VertexCorners& corners, std::int32_t vertex);

  std::int32_t size() const { return static_cast<std::int32_t>(following_.size()); }
  std::int32_t corner(std::int32_t i) const { return corners_[i]; }
  /// The vertex after this one in triangle i. In a closed fan each neighbor follows in exactly one triangle.
  std::int32_t following(std::int32_t i) const { return following_[i]; }
  /// The number of a side is that of the corner where it starts.
  std::int32_t sideNumber(const Side& side) const;

  /// True if the triangles, at most 32, form one closed, oriented fan. Then edges and fans need not be found.
  bool isClosedFan() const { return isClosedFan_; }

  /// Finds the edges, which the functions below need. Cost: n log n.
  void findEdges();
  const std::vector<Edge>& edges() const { return edges_; }

  /// Joins triangles to fans over edges with two sides, and with more if overCrowdedEdges. \return the number of fans
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

/// Calls body(part, ring, vertex) for all vertices. Each range of vertices has its own part. \return the parts in order
/// \param isMember flags of the triangles in the rings; empty: all \param atATime number of vertices whose corners are
/// grouped at once: the corners of all take more memory than the mesh \throw ResourceLimit as groupCorners; Cancelled
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

/// Joins the triangles of a ring that are connected over shared edges. May be called concurrently.
/// \pre Ring::findEdges() was called, unless the ring is a closed fan
void joinTriangles(Ring& ring, DisjointSets& triangles);

/// Numbers the component of each triangle, in the order of the components' first triangles; −1 for triangles with
/// invalid indices or without a flag. \param triangles joined ring by ring \return the number of components
std::int32_t numberComponents(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isMember,
                              DisjointSets& triangles, Execution& execution,
                              std::vector<std::int32_t>& componentOfTriangle);

/// Numbers the components, connected over shared edges, of the triangles with a flag (of all, if there are no flags).
/// \param isTorn receives whether the members around some vertex fall into several fans
std::int32_t groupTriangles(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isMember, Execution& execution,
                            std::vector<std::int32_t>& componentOfTriangle, bool& isTorn);

/// Gives each fan of triangles around a vertex a vertex of its own, so that no two fans meet in a point. The fan of the
/// first triangle keeps the vertex; copies, with all per-vertex arrays, are appended.
void splitFans(TriangleMesh& mesh);

} // namespace pcl::mrf
