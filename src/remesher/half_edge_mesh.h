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

/// New index of each triangle when triangles are sorted by their first vertex; −1 for those with a negative one.
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
/// The operations keep the mesh manifold and oriented as long as their preconditions hold. They do not use positions.
struct HalfEdgeMesh {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals; ///< of the field, unit
  std::vector<std::uint8_t> pinned;     ///< vertices that must stay as they are
  /// Flags of vertices, at first all set. Each triangle that is new or has moved since they were cleared has a corner
  /// with a flag: operations set it for triangles that they make, and code that moves a vertex must set it.
  std::vector<std::uint8_t> changed;
  std::vector<float> sizing;  ///< relative target length of the edges around a vertex; at first 1
  std::vector<double> places; ///< on the BorderCurves; empty if there are none
  /// Region of each vertex, as compact() cuts them. Operations work on several regions concurrently.
  std::vector<std::uint16_t> regions;
  /// In a part of a mesh: numbers in the whole mesh of the vertices that must stay, −1 for the others. Empty: no part.
  std::vector<std::int32_t> numbers;
  std::vector<std::int32_t> outgoing; ///< −1: removed, or in no triangle
  std::vector<std::int32_t> valence;  ///< number of edges of a vertex
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

  /// True if all corners of the triangles beside an edge are in this region, or the edge was removed. Then only work on
  /// this region changes these triangles.
  bool isBetween(std::int32_t h, std::uint16_t region) const
  {
    const auto isIn = [&](std::int32_t side) {
      return regions[origin[side]] == region && regions[target(side)] == region && regions[opposite(side)] == region;
    };
    return origin[h] < 0 || (isIn(h) && (twin[h] < 0 || isIn(twin[h])));
  }
  /// True if all neighbors of both ends of an edge are in this region. \pre isBetween(h, region)
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
  /// For each border vertex the next one on the border, −1 for the other vertices.
  std::vector<std::int32_t> nextOnBorders() const;

  /// Unused entries for the vertex and the two triangles of a split; those of split n are at [n]. They count as removed
  /// until the split is made.
  struct Room {
    std::int32_t vertex, halfEdge;
    Room operator[](std::int32_t n) const { return {vertex + n, halfEdge + 6 * n}; }
  };
  Room makeRoom(std::int32_t splits);

  /// Puts a vertex on the edge of h, with the mean sizing of its ends, and cuts the triangles beside it in two.
  /// \return the new vertex \pre the room has not been used
  std::int32_t split(std::int32_t h, const Room& room, const Eigen::Vector3f& position, const Eigen::Vector3f& normal);
  /// \pre the triangles that the split changed or made have not changed since
  void undoSplit(std::int32_t h, const Room& room);

  /// True if merging the ends of an edge keeps the mesh manifold, its topology (the link condition) and its borders: a
  /// border edge may neither close its boundary loop nor be one of a triangle without neighbors.
  bool mayCollapse(std::int32_t h) const;

  /// Merges the target of h into its origin and removes the triangles beside the edge.
  /// \pre mayCollapse(h), and the target is not on the boundary unless the whole edge is
  void collapse(std::int32_t h);

  /// An edge that collapses, and the surroundings of the triangles that are removed.
  struct Collapsed {
    std::int32_t h, twin;
    std::int32_t kept, gone; ///< the edge's ends
    /// The third vertex, and the half-edges across the next and the previous side: of h's triangle, then of the twin's.
    std::array<std::int32_t, 2> apexes, next, previous;
  };
  /// What undoCollapse() needs. \pre mayCollapse(h)
  Collapsed collapsedBy(std::int32_t h) const;
  /// Undoes all but position, normal, sizing and place of the vertex that was kept.
  /// \pre the triangles of both vertices have not changed since
  void undoCollapse(const Collapsed& edge);

  /// Turns the inner edge of h, so that it joins the two opposite vertices. \pre these are not adjacent
  void flip(std::int32_t h);

  /// Drops removed elements and renumbers the others along a space-filling curve, so that close ones are close in
  /// memory. Regions are ranges of vertices along it, so that few edges leave a region. \pre positions are finite
  void compact(Execution& execution);
  /// Number of vertices in each region but the last. \param vertices number of vertices of the mesh
  static std::int32_t regionSize(std::int32_t vertices);

  Triangle triangle(std::int32_t t) const { return {origin[3 * t], origin[3 * t + 1], origin[3 * t + 2]}; }
  TriangleMesh toTriangles() const;

private:
  /// Calls visit(values, value of a new vertex) for what vertices have besides their regions and half-edges.
  template <typename Visit>
  void forVertexArrays(const Visit& visit);
  int commonNeighbors(std::int32_t v, std::int32_t w) const;
  void link(std::int32_t g, std::int32_t h);
  void replaceOutgoing(std::int32_t vertex, std::int32_t former, std::int32_t h);
  void turnToStart(std::int32_t vertex, std::int32_t h);
  void turnCornersToStart(std::int32_t h);
  void clear(std::int32_t triangle);
};

} // namespace pcl::mrf
