// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/intersection_watch.h"

#include "base/cell_hash.h"
#include "base/loops.h"
#include "mesh/self_intersection.h"

#include <algorithm>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

constexpr std::int64_t vertexGrain = 2048;

/// Max share of watched vertices; beyond it, all are watched. That costs hardly more, and if an intersection is
/// overlooked, the whole mesh is remeshed again.
constexpr double maxWatched = .3;

template <typename Condition>
bool isAnyCorner(const Triangle& triangle, const Condition& holds)
{
  return std::any_of(triangle.begin(), triangle.end(), holds);
}

} // namespace

IntersectionWatch::IntersectionWatch(Place place, const HalfEdgeMesh& mesh, float edge, Execution& execution)
{
  if (place == Place::everywhere)
    return;
  crowded_.emplace(mesh.positions, mesh.normals, 1.5f * edge, execution);
  const std::vector<std::uint8_t> watched = watchedVertices(mesh, execution);
  const auto count = std::count(watched.begin(), watched.end(), 1);
  if (static_cast<double>(count) > maxWatched * static_cast<double>(watched.size()))
    crowded_.reset();
}

std::vector<std::uint8_t> IntersectionWatch::watchedVertices(const HalfEdgeMesh& mesh, Execution& execution) const
{
  std::vector<std::uint8_t> watched(mesh.positions.size(), 1);
  if (crowded_)
    forEachPolling<std::int32_t>(execution, mesh.vertexCount(), vertexGrain, [&](std::int32_t v) {
      watched[v] = mesh.outgoing[v] >= 0 && (mesh.onBoundary(v) || crowded_->contains(mesh.positions[v])) ? 1 : 0;
    });
  return watched;
}

std::vector<std::int32_t> IntersectionWatch::intersectingTriangles(const HalfEdgeMesh& mesh,
                                                                   const std::vector<std::uint8_t>& changed,
                                                                   Execution& execution) const
{
  const std::vector<std::uint8_t> watched = watchedVertices(mesh, execution);
  TriangleMesh part;
  std::vector<std::int32_t> own;
  std::vector<std::uint8_t> marked;
  for (std::int32_t t = 0; t < mesh.halfEdgeCount() / 3; ++t) {
    const Triangle vertices = mesh.triangle(t);
    if (vertices[0] >= 0 && isAnyCorner(vertices, [&](std::int32_t v) { return watched[v] != 0; })) {
      part.triangles.push_back(vertices);
      own.push_back(t);
      if (!changed.empty())
        marked.push_back(isAnyCorner(vertices, [&](std::int32_t v) { return changed[v] != 0; }) ? 1 : 0);
    }
  }
  part.vertices = mesh.positions;
  execution.poll();
  std::vector<std::int32_t> result = selfIntersectingTriangles(part, execution, marked);
  for (std::int32_t& t : result)
    t = own[t];
  return result;
}

std::vector<std::int32_t> IntersectionWatch::newIntersections(HalfEdgeMesh& mesh, Execution& execution) const
{
  std::vector<std::int32_t> triangles = changeable(mesh, intersectingTriangles(mesh, mesh.changed, execution));
  std::fill(mesh.changed.begin(), mesh.changed.end(), std::uint8_t{0});
  for (const std::int32_t t : triangles)
    for (const std::int32_t v : mesh.triangle(t))
      mesh.changed[v] = 1;
  return triangles;
}

std::vector<std::int32_t> changeable(const HalfEdgeMesh& mesh, std::vector<std::int32_t> triangles)
{
  const auto isPinned = [&](std::int32_t t) {
    return !isAnyCorner(mesh.triangle(t), [&](std::int32_t v) { return mesh.pinned[v] == 0; });
  };
  triangles.erase(std::remove_if(triangles.begin(), triangles.end(), isPinned), triangles.end());
  return triangles;
}

void pinAround(const std::vector<Vector3f>& centers, float radius, const std::vector<Vector3f>& positions,
               std::vector<std::uint8_t>& pinned)
{
  Vector3f lower = centers.empty() ? Vector3f::Zero() : centers.front();
  for (const Vector3f& center : centers)
    lower = lower.cwiseMin(center);
  // No center is in the first two cells: the first one, to which all positions before it belong, is not pinned.
  const Eigen::Array3d first = (lower.array() / radius).floor().cast<double>() - 2;
  CellHash cells(radius * first.matrix(), radius);
  for (const Vector3f& center : centers)
    CellHash::forEachAround(cells.cellOf(center), [&](const CellHash::Cell& cell) { cells.add(cell); });
  for (std::size_t v = 0; v < positions.size(); ++v)
    if (cells.find(cells.cellOf(positions[v])) != CellHash::none)
      pinned[v] = 1;
}

} // namespace pcl::mrf
