#include "mesh_topology.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <string>

namespace pcl {
namespace mrf {

DisjointSets::DisjointSets(std::size_t count) : parent_(count)
{
  std::iota(parent_.begin(), parent_.end(), 0);
}

std::int32_t DisjointSets::find(std::int32_t element)
{
  auto* parent = parent_.data();
  while (parent[element] != element) {
    parent[element] = parent[parent[element]];
    element = parent[element];
  }
  return element;
}

void DisjointSets::unite(std::int32_t a, std::int32_t b)
{
  a = find(a);
  b = find(b);
  parent_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
}

bool hasValidIndices(const TriangleMesh& mesh, std::size_t triangle)
{
  const Triangle& t = mesh.triangles[triangle];
  const auto inside = [&](std::int32_t v) { return v >= 0 && static_cast<std::size_t>(v) < mesh.vertices.size(); };
  return inside(t[0]) && inside(t[1]) && inside(t[2]) && t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
}

EdgeSides groupSides(const TriangleMesh& mesh)
{
  if (mesh.triangles.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max() / 3))
    throw ResourceLimit("the mesh has " + std::to_string(mesh.triangles.size()) +
                        " triangles, more than 32-bit indices can tell apart; use larger voxels");
  struct Entry {
    std::int32_t larger, side;
    bool operator<(const Entry& other) const
    {
      return larger != other.larger ? larger < other.larger : side < other.side;
    }
  };
  const auto forEachSide = [&](const auto& visit) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (!hasValidIndices(mesh, t))
        continue;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::int32_t a = mesh.triangles[t][c], b = mesh.triangles[t][(c + 1) % 3];
        visit(static_cast<std::size_t>(std::min(a, b)), Entry{std::max(a, b), static_cast<std::int32_t>(3 * t + c)});
      }
    }
  };
  // A counting sort by the smaller vertex leaves a few sides per bucket.
  std::vector<std::int32_t> position(mesh.vertices.size() + 1, 0);
  forEachSide([&](std::size_t smaller, const Entry&) { ++position[smaller + 1]; });
  std::partial_sum(position.begin(), position.end(), position.begin());
  std::vector<Entry> entries(static_cast<std::size_t>(position.back()));
  forEachSide(
      [&](std::size_t smaller, const Entry& entry) { entries[static_cast<std::size_t>(position[smaller]++)] = entry; });

  EdgeSides edges;
  edges.sides.reserve(entries.size());
  std::int32_t bucketBegin = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const std::int32_t bucketEnd = position[v]; // the counting sort has moved each position to the end of its bucket
    std::sort(entries.begin() + bucketBegin, entries.begin() + bucketEnd);
    for (std::int32_t n = bucketBegin; n < bucketEnd; ++n) {
      const Entry& entry = entries[static_cast<std::size_t>(n)];
      if (n == bucketBegin || entry.larger != entries[static_cast<std::size_t>(n - 1)].larger)
        edges.begin.push_back(n);
      edges.sides.push_back(entry.side);
    }
    bucketBegin = bucketEnd;
  }
  edges.begin.push_back(bucketBegin);
  return edges;
}

DisjointSets groupTriangles(const EdgeSides& edges, const std::vector<std::uint8_t>& isMember)
{
  DisjointSets sets(isMember.size());
  for (std::size_t e = 0; e < edges.count(); ++e) {
    std::int32_t previous = -1;
    for (std::int32_t n = 0; n < edges.sidesOf(e); ++n) {
      const std::int32_t triangle = edges.side(e, n) / 3;
      if (!isMember[static_cast<std::size_t>(triangle)])
        continue;
      if (previous >= 0)
        sets.unite(previous, triangle);
      previous = triangle;
    }
  }
  return sets;
}

DisjointSets groupFans(const TriangleMesh& mesh, const EdgeSides& edges)
{
  DisjointSets fans(3 * mesh.triangles.size());
  for (std::size_t e = 0; e < edges.count(); ++e) {
    if (edges.sidesOf(e) != 2)
      continue;
    const std::int32_t a = edges.side(e, 0), b = edges.side(e, 1);
    const bool opposed = vertexAt(mesh, a) != vertexAt(mesh, b);
    fans.unite(a, opposed ? nextCorner(b) : b);
    fans.unite(nextCorner(a), opposed ? b : nextCorner(b));
  }
  return fans;
}

void splitFans(TriangleMesh& mesh)
{
  DisjointSets fans = groupFans(mesh, groupSides(mesh));
  constexpr std::int32_t none = -1;
  std::vector<std::int32_t> owner(mesh.vertices.size(), none); // the fan that keeps the vertex
  std::vector<std::int32_t> copyOf(3 * mesh.triangles.size(), none);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!hasValidIndices(mesh, t))
      continue;
    for (std::size_t c = 0; c < 3; ++c) {
      std::int32_t& vertex = mesh.triangles[t][c];
      const std::int32_t fan = fans.find(static_cast<std::int32_t>(3 * t + c));
      const auto v = static_cast<std::size_t>(vertex);
      if (owner[v] == none)
        owner[v] = fan;
      if (owner[v] == fan)
        continue;
      std::int32_t& copy = copyOf[static_cast<std::size_t>(fan)];
      if (copy == none) {
        copy = static_cast<std::int32_t>(mesh.vertices.size());
        mesh.vertices.push_back(Eigen::Vector3f(mesh.vertices[v]));
        if (!mesh.normals.empty())
          mesh.normals.push_back(Eigen::Vector3f(mesh.normals[v]));
        if (!mesh.confidences.empty())
          mesh.confidences.push_back(float{mesh.confidences[v]});
      }
      vertex = copy;
    }
  }
}

} // namespace mrf
} // namespace pcl
