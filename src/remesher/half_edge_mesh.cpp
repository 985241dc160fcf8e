// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/half_edge_mesh.h"

#include "base/loops.h"
#include "base/spatial_sort.h"
#include "mesh/mesh_topology.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <numeric>
#include <string>
#include <type_traits>

namespace pcl::mrf {
namespace {

constexpr std::int64_t renumberingGrain = 16384;

[[noreturn]] void refuse(std::int32_t triangle, const std::string& reason)
{
  throw InvalidInput("the mesh to remesh must be oriented and manifold: triangle " + std::to_string(triangle) + " " +
                     reason);
}

} // namespace

std::vector<std::int32_t> placesByFirstVertex(std::size_t triangles, std::size_t vertices,
                                              const std::function<std::int32_t(std::int32_t triangle)>& firstVertex)
{
  std::vector<std::int32_t> result(triangles), next(vertices + 1, 0);
  for (std::size_t t = 0; t < triangles; ++t) {
    result[t] = firstVertex(static_cast<std::int32_t>(t));
    if (result[t] >= 0)
      ++next[result[t] + 1];
  }
  std::partial_sum(next.begin(), next.end(), next.begin());
  for (std::int32_t& place : result)
    if (place >= 0)
      place = next[place]++;
  return result;
}

HalfEdgeMesh::HalfEdgeMesh(const TriangleMesh& mesh, Execution& execution)
    : positions(mesh.vertices), normals(mesh.vertices.size(), Eigen::Vector3f::Zero()), pinned(mesh.vertices.size(), 0),
      changed(mesh.vertices.size(), 1), sizing(mesh.vertices.size(), 1), regions(mesh.vertices.size(), 0),
      outgoing(mesh.vertices.size(), -1), valence(mesh.vertices.size(), 0), origin(3 * mesh.triangles.size()),
      twin(3 * mesh.triangles.size(), -1)
{
  for (std::int32_t h = 0; h < halfEdgeCount(); ++h) {
    const Triangle& t = mesh.triangles[h / 3];
    origin[h] = t[h % 3];
    if (origin[h] < 0 || origin[h] >= vertexCount())
      refuse(h / 3, "has a vertex index out of range");
    if (origin[h] == t[(h + 1) % 3])
      refuse(h / 3, "uses a vertex twice");
    if (!positions[origin[h]].allFinite())
      refuse(h / 3, "has a vertex that is not finite");
  }
  execution.poll();
  // Groups the half-edges by their origin, so that only a few are compared to find a twin.
  const VertexCorners corners = groupCorners(mesh);
  const std::vector<std::int32_t>&begin = corners.begin, &starting = corners.corners;
  execution.poll();

  for (std::int32_t h = 0; h < halfEdgeCount(); ++h) {
    const std::int32_t from = origin[h], to = target(h);
    for (std::int32_t i = begin[to]; i < begin[to + 1]; ++i)
      if (target(starting[i]) == from)
        twin[h] = starting[i];
    for (std::int32_t i = begin[from]; i < begin[from + 1]; ++i)
      if (starting[i] != h && target(starting[i]) == to)
        refuse(h / 3, "shares a directed edge with another one");
  }
  execution.poll();
  for (std::int32_t v = 0; v < vertexCount(); ++v) {
    const std::int32_t triangles = begin[v + 1] - begin[v];
    if (triangles == 0)
      continue;
    turnToStart(v, starting[begin[v]]);
    forOutgoing(v, [&](std::int32_t) { ++valence[v]; });
    if (valence[v] != triangles)
      refuse(starting[begin[v]] / 3, "meets another one at a single vertex only");
    if (onBoundary(v))
      ++valence[v];
  }
}

void HalfEdgeMesh::link(std::int32_t g, std::int32_t h)
{
  if (g >= 0)
    twin[g] = h;
  if (h >= 0)
    twin[h] = g;
}

void HalfEdgeMesh::replaceOutgoing(std::int32_t vertex, std::int32_t former, std::int32_t h)
{
  if (outgoing[vertex] == former)
    outgoing[vertex] = h;
}

void HalfEdgeMesh::turnToStart(std::int32_t vertex, std::int32_t h)
{
  const std::int32_t first = h;
  while (twin[h] >= 0) {
    h = next(twin[h]);
    if (h == first)
      break;
  }
  outgoing[vertex] = h;
}

void HalfEdgeMesh::turnCornersToStart(std::int32_t h)
{
  for (const std::int32_t side : {h, next(h), previous(h)})
    turnToStart(origin[side], side);
}

void HalfEdgeMesh::clear(std::int32_t triangle)
{
  for (std::int32_t h = 3 * triangle; h < 3 * triangle + 3; ++h) {
    origin[h] = -1;
    twin[h] = -1;
  }
}

std::int32_t HalfEdgeMesh::regionSize(std::int32_t vertices)
{
  // Small enough for some threads, but large, as one thread works on the edges across their borders.
  return std::clamp(vertices / 16, 4096, 32768);
}

bool HalfEdgeMesh::adjacent(std::int32_t v, std::int32_t w) const
{
  bool found = false;
  forNeighbors(v, [&](std::int32_t neighbor) { found = found || neighbor == w; });
  return found;
}

template <typename Visit>
void HalfEdgeMesh::forVertexArrays(const Visit& visit)
{
  const Eigen::Vector3f zero = Eigen::Vector3f::Zero();
  visit(positions, zero);
  visit(normals, zero);
  visit(pinned, std::uint8_t{0});
  visit(changed, std::uint8_t{0});
  visit(sizing, 1.f);
  if (!places.empty())
    visit(places, -1.);
  if (!numbers.empty())
    visit(numbers, -1);
  visit(valence, 0);
}

HalfEdgeMesh::Room HalfEdgeMesh::makeRoom(std::int32_t splits)
{
  const Room room{vertexCount(), halfEdgeCount()};
  const std::size_t vertices = positions.size() + splits, halfEdges = origin.size() + 6 * std::size_t(splits);
  const auto grow = [](auto& values, std::size_t size, const auto& value) {
    values.reserve(size); // exactly: a vector that grows by itself takes up to twice its size
    values.resize(size, value);
  };
  forVertexArrays([&](auto& values, const auto& value) { grow(values, vertices, value); });
  grow(regions, vertices, std::uint16_t{0});
  grow(outgoing, vertices, -1);
  grow(origin, halfEdges, -1);
  grow(twin, halfEdges, -1);
  return room;
}

std::int32_t HalfEdgeMesh::split(std::int32_t h, const Room& room, const Eigen::Vector3f& position,
                                 const Eigen::Vector3f& normal)
{
  const std::int32_t m = room.vertex;
  positions[m] = position;
  normals[m] = normal;
  changed[m] = 1;
  sizing[m] = .5f * (sizing[origin[h]] + sizing[target(h)]);
  regions[m] = regions[origin[h]];
  valence[m] = 3;
  const auto add = [this](std::int32_t t, std::initializer_list<std::int32_t> corners) {
    std::copy(corners.begin(), corners.end(), origin.begin() + t);
  };

  // a→b with c on the left becomes a→m (in the old triangle) and m→b (in a new one).
  const std::int32_t g = twin[h], hNext = next(h), b = origin[hNext], c = opposite(h);
  const std::int32_t upper = room.halfEdge;
  add(upper, {m, b, c});
  link(upper + 1, twin[hNext]);
  origin[hNext] = m;
  link(hNext, upper + 2);
  replaceOutgoing(b, hNext, upper + 1);
  ++valence[c];
  outgoing[m] = upper;
  if (g < 0)
    return m;

  // b→a with d on its left becomes b→m (in the old triangle) and m→a (in a new one).
  const std::int32_t gNext = next(g), a = origin[gNext], d = opposite(g);
  const std::int32_t lower = upper + 3;
  add(lower, {m, a, d});
  link(lower + 1, twin[gNext]);
  origin[gNext] = m;
  link(gNext, lower + 2);
  replaceOutgoing(a, gNext, lower + 1);
  ++valence[d];
  valence[m] = 4;
  link(h, lower);
  link(g, upper);
  return m;
}

void HalfEdgeMesh::undoSplit(std::int32_t h, const Room& room)
{
  const auto join = [this](std::int32_t side, std::int32_t half) {
    origin[next(side)] = origin[next(half)];
    --valence[opposite(half)];
    link(next(side), twin[next(half)]);
    clear(half / 3);
  };
  const std::int32_t upper = room.halfEdge, g = twin[upper];
  join(h, upper);
  if (g >= 0)
    join(g, upper + 3);
  link(h, g);
  outgoing[room.vertex] = -1;
  changed[origin[h]] = 1;
  turnCornersToStart(h);
  if (g >= 0)
    turnCornersToStart(g);
}

bool HalfEdgeMesh::mayCollapse(std::int32_t h) const
{
  const std::int32_t a = origin[h], b = target(h);
  if (twin[h] < 0) {
    const bool isLone = twin[next(h)] < 0 && twin[previous(h)] < 0;
    return !isLone && commonNeighbors(a, b) == 1;
  }
  if (onBoundary(a) && onBoundary(b))
    return false;
  if (valence[a] <= 3 && valence[b] <= 3)
    return false; // a tetrahedron, or a disc of which a single triangle would remain
  return commonNeighbors(a, b) == 2;
}

int HalfEdgeMesh::commonNeighbors(std::int32_t v, std::int32_t w) const
{
  std::array<std::int32_t, 16> around; // neighbors of v, collected once, unless there are more
  std::size_t count = 0;
  forNeighbors(v, [&](std::int32_t neighbor) {
    if (count < around.size())
      around[count] = neighbor;
    ++count;
  });
  int common = 0;
  forNeighbors(w, [&](std::int32_t neighbor) {
    const bool isCommon = count <= around.size()
                              ? std::find(around.begin(), around.begin() + count, neighbor) != around.begin() + count
                              : adjacent(v, neighbor);
    common += isCommon ? 1 : 0;
  });
  return common;
}

std::int32_t HalfEdgeMesh::previousOnBorder(std::int32_t vertex) const
{
  std::int32_t last = -1;
  forOutgoing(vertex, [&](std::int32_t h) { last = h; });
  return opposite(last);
}

std::vector<std::int32_t> HalfEdgeMesh::nextOnBorders() const
{
  std::vector<std::int32_t> result(positions.size(), -1);
  for (std::int32_t v = 0; v < vertexCount(); ++v)
    if (outgoing[v] >= 0 && onBoundary(v))
      result[v] = nextOnBorder(v);
  return result;
}

void HalfEdgeMesh::collapse(std::int32_t h)
{
  const std::int32_t g = twin[h], a = origin[h], b = target(h);
  const std::int32_t first = outgoing[b];
  std::int32_t spoke = first;
  do {
    const std::int32_t following = twin[previous(spoke)];
    origin[spoke] = a;
    spoke = following;
  } while (spoke >= 0 && spoke != first);
  changed[a] = 1;
  sizing[a] = .5f * (sizing[a] + sizing[b]);
  valence[a] += valence[b] - (g < 0 ? 3 : 4);
  outgoing[b] = -1;

  /// Surroundings of a triangle that is removed: its third vertex, and the half-edges across its other sides.
  struct Around {
    std::int32_t apex, next, previous;
  };
  const auto remove = [this](std::int32_t side) {
    const Around around{opposite(side), twin[next(side)], twin[previous(side)]};
    --valence[around.apex];
    clear(side / 3);
    link(around.next, around.previous);
    return around;
  };
  const Around left = remove(h), right = g < 0 ? left : remove(g); // on the border both are the same
  turnToStart(a, left.previous >= 0 ? left.previous : next(left.next));
  for (const Around& around : {left, right})
    turnToStart(around.apex, around.next >= 0 ? around.next : next(around.previous));
}

HalfEdgeMesh::Collapsed HalfEdgeMesh::collapsedBy(std::int32_t h) const
{
  const std::int32_t g = twin[h], other = g < 0 ? h : g;
  return {h,
          g,
          origin[h],
          target(h),
          {opposite(h), opposite(other)},
          {twin[next(h)], twin[next(other)]},
          {twin[previous(h)], twin[previous(other)]}};
}

void HalfEdgeMesh::undoCollapse(const Collapsed& edge)
{
  const auto restore = [&](std::int32_t side, std::int32_t from, std::int32_t to, std::size_t n) {
    origin[side] = from;
    origin[next(side)] = to;
    origin[previous(side)] = edge.apexes[n];
    link(next(side), edge.next[n]);
    link(previous(side), edge.previous[n]);
    ++valence[edge.apexes[n]];
  };
  restore(edge.h, edge.kept, edge.gone, 0);
  if (edge.twin >= 0)
    restore(edge.twin, edge.gone, edge.kept, 1);
  link(edge.h, edge.twin);
  turnToStart(edge.gone, next(edge.h));
  forOutgoing(edge.gone, [&](std::int32_t spoke) { origin[spoke] = edge.gone; });
  valence[edge.kept] -= valence[edge.gone] - (edge.twin < 0 ? 3 : 4);
  changed[edge.kept] = 1;
  changed[edge.gone] = 1;
  turnCornersToStart(edge.h);
  if (edge.twin >= 0)
    turnCornersToStart(edge.twin);
}

void HalfEdgeMesh::flip(std::int32_t h)
{
  const std::int32_t g = twin[h];
  const std::int32_t hNext = next(h), hPrevious = previous(h), gNext = next(g), gPrevious = previous(g);
  const std::int32_t a = origin[h], b = origin[g], c = origin[hPrevious], d = origin[gPrevious];
  const std::int32_t outerBC = twin[hNext], outerDB = twin[gPrevious];
  const std::int32_t outerCA = twin[hPrevious], outerAD = twin[gNext];
  changed[c] = 1;
  --valence[a];
  --valence[b];
  ++valence[c];
  ++valence[d];

  // (a, b, c) and (b, a, d) become (d, c, a) and (c, d, b).
  origin[h] = d;
  origin[hNext] = c;
  origin[hPrevious] = a;
  origin[g] = c;
  origin[gNext] = d;
  origin[gPrevious] = b;
  link(hNext, outerCA);
  link(hPrevious, outerAD);
  link(gNext, outerDB);
  link(gPrevious, outerBC);
  const std::int32_t formerA = outgoing[a], formerB = outgoing[b], formerC = outgoing[c], formerD = outgoing[d];
  if (formerA == h || formerA == gNext)
    outgoing[a] = hPrevious;
  if (formerB == g || formerB == hNext)
    outgoing[b] = gPrevious;
  if (formerC == hPrevious)
    outgoing[c] = hNext;
  if (formerD == gPrevious)
    outgoing[d] = gNext;
}

void HalfEdgeMesh::compact(Execution& execution)
{
  std::vector<std::uint8_t> isUsed(positions.size());
  for (std::size_t v = 0; v < positions.size(); ++v)
    isUsed[v] = outgoing[v] >= 0 ? 1 : 0;
  const std::vector<std::uint32_t> order = spatialOrder(positions, isUsed, execution);
  std::vector<std::int32_t> newVertex(positions.size(), -1);
  for (std::size_t n = 0; n < order.size(); ++n)
    newVertex[order[n]] = static_cast<std::int32_t>(n);

  // Sorts triangles by their first vertex in the new order. A half-edge keeps its place within its triangle.
  const std::int32_t triangles = halfEdgeCount() / 3;
  const std::vector<std::int32_t> newTriangle =
      placesByFirstVertex(triangles, order.size(), [&](std::int32_t t) -> std::int32_t {
        if (origin[3 * t] < 0)
          return -1;
        return std::min({newVertex[origin[3 * t]], newVertex[origin[3 * t + 1]], newVertex[origin[3 * t + 2]]});
      });
  const auto count = triangles - std::count(newTriangle.begin(), newTriangle.end(), -1);
  execution.poll();
  const auto renumber = [&](std::int32_t h) { return h < 0 ? -1 : 3 * newTriangle[h / 3] + h % 3; };
  std::vector<std::int32_t> newOrigin(3 * count), newTwin(3 * count);
  forEach<std::int32_t>(execution, halfEdgeCount(), 3 * renumberingGrain, [&](std::int32_t h) {
    if (origin[h] < 0)
      return;
    const std::int32_t moved = renumber(h);
    newOrigin[moved] = newVertex[origin[h]];
    newTwin[moved] = renumber(twin[h]);
  });
  origin.swap(newOrigin);
  twin.swap(newTwin);
  const auto reorder = [&](auto& values, const auto&) {
    std::decay_t<decltype(values)> moved(order.size());
    forEach(execution, order.size(), renumberingGrain, [&](std::size_t n) { moved[n] = values[order[n]]; });
    values.swap(moved);
  };
  forVertexArrays(reorder);
  reorder(outgoing, -1);
  const std::int32_t vertices = regionSize(vertexCount());
  regions.resize(positions.size());
  forEach<std::int32_t>(execution, vertexCount(), renumberingGrain, [&](std::int32_t v) {
    regions[v] = static_cast<std::uint16_t>(v / vertices);
    outgoing[v] = renumber(outgoing[v]);
  });
}

TriangleMesh HalfEdgeMesh::toTriangles() const
{
  TriangleMesh mesh;
  mesh.vertices = positions;
  mesh.triangles.reserve(origin.size() / 3);
  for (std::int32_t t = 0; 3 * t < halfEdgeCount(); ++t)
    mesh.triangles.push_back(triangle(t));
  return mesh;
}

} // namespace pcl::mrf
