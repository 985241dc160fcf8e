// SPDX-License-Identifier: BSD-3-Clause
/// The connectivity the remesher works on: half-edges in plain index arrays.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace pcl::mrf {

/// Where triangles go that are ordered by the first of their vertices; −1: those without.
std::vector<std::int32_t> placesByFirstVertex(std::size_t triangles, std::size_t vertices,
                                              const std::function<std::int32_t(std::int32_t triangle)>& firstVertex);

/// An oriented manifold triangle mesh, with or without boundary, and its local operations.
///
/// Triangle t owns the half-edges 3t, 3t+1, 3t+2; half-edge h runs counter-clockwise from origin[h] to the origin of
/// the next one:
///
///          c
///         / \          h = 3t + i : a → b
///    h+2 /   \ h+1     twin[h]    : b → a in the triangle below, −1 on the boundary
///       /  t  \        outgoing[v]: a half-edge that starts at v; at a boundary vertex the one without a twin, so that
///      a-------b                    turning counter-clockwise from it meets all triangles of v
///          h
///
/// The operations keep the mesh manifold and oriented as long as their preconditions hold; they look at no positions.
struct HalfEdgeMesh {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals; ///< of the field, unit
  std::vector<std::uint8_t> pinned;     ///< vertices that must stay as they are
  /// Set for a corner or more of every triangle that is new or has moved since all were set to zero; at first for all.
  /// The operations do so for the triangles that they make; who moves a vertex has to.
  std::vector<std::uint8_t> changed;
  std::vector<float> sizing;  ///< length of the edges around a vertex that is aimed at, relative; at first 1
  std::vector<double> places; ///< on the BorderCurves; empty if there are none
  /// Pieces of the surface that what changes the mesh works on concurrently, by vertex: as compact() cuts them.
  std::vector<std::uint16_t> regions;
  /// Of a part of a mesh: numbers that vertices have there which must stay, −1 for the others. Empty: it is no part.
  std::vector<std::int32_t> numbers;
  std::vector<std::int32_t> outgoing; ///< −1: removed, or in no triangle
  std::vector<std::int32_t> valence;  ///< edges of a vertex
  std::vector<std::int32_t> origin;   ///< −1 in removed triangles
  std::vector<std::int32_t> twin;

  /// \throw InvalidInput if the triangles are not an oriented manifold
  HalfEdgeMesh(const TriangleMesh& mesh, Execution& execution);
  HalfEdgeMesh() = default;

  std::int32_t vertexCount() const { return static_cast<std::int32_t>(positions.size()); }
  std::int32_t halfEdgeCount() const { return static_cast<std::int32_t>(origin.size()); }

  static std::int32_t next(std::int32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static std::int32_t previous(std::int32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }
  std::int32_t target(std::int32_t h) const { return origin[next(h)]; }
  std::int32_t opposite(std::int32_t h) const { return origin[previous(h)]; }
  bool onBoundary(std::int32_t vertex) const { return twin[outgoing[vertex]] < 0; }

  /// True for one half-edge per edge of the mesh.
  bool represents(std::int32_t h) const { return origin[h] >= 0 && h > twin[h]; }

  /// Calls body(h) for the half-edges that start at a vertex, counter-clockwise: one per triangle of the vertex.
  template <typename Body>
  void forOutgoing(std::int32_t vertex, const Body& body) const
  {
    const std::int32_t start = outgoing[vertex];
    std::int32_t h = start;
    do {
      body(h);
      h = twin[previous(h)];
    } while (h >= 0 && h != start);
  }

  /// Calls body(w) for the vertices joined to a vertex by an edge, counter-clockwise.
  template <typename Body>
  void forNeighbors(std::int32_t vertex, const Body& body) const
  {
    std::int32_t last = -1;
    forOutgoing(vertex, [&](std::int32_t h) {
      body(target(h));
      last = h;
    });
    if (onBoundary(vertex))
      body(opposite(last));
  }

  bool adjacent(std::int32_t v, std::int32_t w) const;

  /// True if the corners of the triangles beside an edge are of this region, or the triangles are gone: then nothing of
  /// them changes but by what works on the region.
  bool isBetween(std::int32_t h, std::uint16_t region) const
  {
    const auto isIn = [&](std::int32_t side) {
      return regions[origin[side]] == region && regions[target(side)] == region && regions[opposite(side)] == region;
    };
    return origin[h] < 0 || (isIn(h) && (twin[h] < 0 || isIn(twin[h])));
  }
  /// True if all is of this region that is joined to the ends of an edge. \pre isBetween(h, region)
  bool isAmid(std::int32_t h, std::uint16_t region) const
  {
    bool isAmid = true;
    for (const std::int32_t end : {origin[h], target(h)})
      forNeighbors(end, [&](std::int32_t w) { isAmid = isAmid && regions[w] == region; });
    return isAmid;
  }

  /// \pre the vertex is on the boundary
  std::int32_t nextOnBorder(std::int32_t vertex) const { return target(outgoing[vertex]); }
  std::int32_t previousOnBorder(std::int32_t vertex) const;
  /// The next one on the border of each vertex that is there, −1 for the others.
  std::vector<std::int32_t> nextOnBorders() const;

  /// Room for a vertex and two triangles, and for more after them: of one for each split to be made, as long as none is
  /// they count as removed.
  struct Room {
    std::int32_t vertex, halfEdge;
    Room operator[](std::int32_t n) const { return {vertex + n, halfEdge + 6 * n}; }
  };
  Room makeRoom(std::int32_t splits);

  /// Puts a vertex on the edge of h, sized between its ends, and cuts the triangles beside it in two. \return the new
  /// vertex \pre the room has not been used
  std::int32_t split(std::int32_t h, const Room& room, const Eigen::Vector3f& position, const Eigen::Vector3f& normal);
  /// \pre nothing was done since to the triangles that the split changed or made
  void undoSplit(std::int32_t h, const Room& room);

  /// True if merging the ends of an edge keeps the mesh manifold and its topology (the link condition), and its
  /// borders: of a border edge, which has no twin, neither may the loop close, nor a lone triangle go.
  bool mayCollapse(std::int32_t h) const;

  /// Merges the target of h into its origin; the triangles beside it go. \pre mayCollapse(h), the target is not on the
  /// boundary unless all of the edge is
  void collapse(std::int32_t h);

  /// An edge that collapses, and what is around the triangles that go.
  struct Collapsed {
    std::int32_t h, twin;
    std::int32_t kept, gone; ///< the ends
    /// The third vertex, and the half-edges across the next and the previous side; second of the twin's triangle.
    std::array<std::int32_t, 2> apexes, next, previous;
  };
  /// What is to be known to undo it. \pre mayCollapse(h)
  Collapsed collapsedBy(std::int32_t h) const;
  /// All but position, normal, sizing and place of the vertex that was kept, which may have moved.
  /// \pre nothing was done since to the triangles of either vertex
  void undoCollapse(const Collapsed& edge);

  /// Turns the inner edge of h to join the two opposite vertices. \pre they are not adjacent
  void flip(std::int32_t h);

  /// Drops what was removed and renumbers the rest along a space-filling curve: what is close is close in memory, and
  /// few edges leave a region, as which ranges of vertices are taken. \pre positions are finite
  void compact(Execution& execution);
  /// Vertices of a region, but for the last, of a mesh of so many.
  static std::int32_t regionSize(std::int32_t vertices);

  Triangle triangle(std::int32_t t) const { return {origin[3 * t], origin[3 * t + 1], origin[3 * t + 2]}; }
  TriangleMesh toTriangles() const;

private:
  int commonNeighbors(std::int32_t v, std::int32_t w) const;
  void link(std::int32_t g, std::int32_t h);
  void replaceOutgoing(std::int32_t vertex, std::int32_t former, std::int32_t h);
  void turnToStart(std::int32_t vertex, std::int32_t h);
  void turnCornersToStart(std::int32_t h);
  void clear(std::int32_t triangle);
};

} // namespace pcl::mrf
