// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/mesh_topology.h"

#include "base/disjoint_sets.h"

#include <pcl/surface/mrf/exceptions.h>

#include <limits>
#include <numeric>
#include <string>
#include <type_traits>

namespace pcl::mrf {
namespace {

constexpr std::int64_t vertexGrain = 8192, triangleGrain = 16384;

} // namespace

VertexCorners groupCorners(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isMember)
{
  if (mesh.triangles.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max() / 3))
    throw ResourceLimit("the mesh has " + std::to_string(mesh.triangles.size()) +
                        " triangles, more than 32-bit indices can tell apart; use larger voxels");
  const auto forMembers = [&](const auto& visit) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      if ((isMember.empty() || isMember[t]) && hasValidIndices(mesh, t))
        for (std::size_t i = 0; i < 3; ++i)
          visit(mesh.triangles[t][i], static_cast<std::int32_t>(3 * t + i));
  };
  VertexCorners result;
  // Counted one place ahead, so that filling moves each vertex's position from its begin to its end.
  result.begin.assign(mesh.vertices.size() + 2, 0);
  forMembers([&](std::size_t v, std::int32_t) { ++result.begin[v + 2]; });
  std::partial_sum(result.begin.begin(), result.begin.end(), result.begin.begin());
  result.corners.resize(result.begin.back());
  forMembers([&](std::size_t v, std::int32_t corner) { result.corners[result.begin[v + 1]++] = corner; });
  result.begin.pop_back();
  return result;
}

void Ring::set(const TriangleMesh& mesh, const VertexCorners& corners, std::int32_t vertex)
{
  corners_ = corners.corners.data() + corners.begin[vertex];
  const std::int32_t count = corners.begin[vertex + 1] - corners.begin[vertex];
  following_.resize(count);
  preceding_.resize(count);
  for (std::int32_t i = 0; i < count; ++i) {
    const Triangle& t = mesh.triangles[corners_[i] / 3];
    const std::int32_t place = corners_[i] % 3;
    following_[i] = t[place == 2 ? 0 : place + 1];
    preceding_[i] = t[place == 0 ? 2 : place - 1];
  }
  isClosedFan_ = closes();
}

std::int32_t Ring::sideNumber(const Side& side) const
{
  const std::int32_t c = corner(side.at);
  return side.isOutgoing ? c : c % 3 == 0 ? c + 2 : c - 1;
}

bool Ring::closes() const
{
  const std::size_t count = following_.size();
  if (count < 3 || count > 32)
    return false;
  // Back at the first triangle after exactly `count` steps, each to the only triangle that follows: all were met.
  std::size_t i = 0;
  for (std::size_t steps = 1;; ++steps) {
    std::size_t next = 0;
    while (next < count && following_[next] != preceding_[i])
      ++next;
    if (next == count)
      return false;
    if (next == 0)
      return steps == count;
    if (steps == count)
      return false;
    i = next;
  }
}

void Ring::findEdges()
{
  sides_.clear();
  for (std::int32_t i = 0; i < size(); ++i) {
    sides_.push_back({following_[i], i, true});
    sides_.push_back({preceding_[i], i, false});
  }
  std::sort(sides_.begin(), sides_.end(),
            [](const Side& a, const Side& b) { return a.to != b.to ? a.to < b.to : a.at < b.at; });
  edges_.clear();
  for (const Side& side : sides_)
    if (edges_.empty() || edges_.back().to() != side.to)
      edges_.push_back({&side, &side + 1});
    else
      ++edges_.back().end;
}

std::int32_t Ring::findFan(std::int32_t i) const
{
  while (fans_[i] != i)
    i = fans_[i];
  return i;
}

std::int32_t Ring::joinFans(bool overCrowdedEdges)
{
  fans_.resize(following_.size());
  std::iota(fans_.begin(), fans_.end(), 0);
  for (const Edge& edge : edges_) {
    if (edge.sides() != 2 && !overCrowdedEdges)
      continue;
    for (const Side* side = edge.begin + 1; side < edge.end; ++side) {
      const std::int32_t a = findFan(edge.begin->at), b = findFan(side->at);
      fans_[std::max(a, b)] = std::min(a, b);
    }
  }
  std::int32_t count = 0;
  for (std::int32_t i = 0; i < size(); ++i) {
    fans_[i] = fans_[fans_[i]]; // the fan's first triangle comes first and is settled
    count += fans_[i] == i ? 1 : 0;
  }
  return count;
}

void EdgeConnectivity::note(std::int32_t vertex, Ring& ring, std::vector<CornerFan>& separate)
{
  std::int32_t smallest = vertex;
  if (ring.isClosedFan()) {
    for (std::int32_t i = 0; i < ring.size(); ++i)
      smallest = std::min(smallest, ring.following(i));
  } else if (ring.joinFans(true) > 1) {
    for (std::int32_t i = 0; i < ring.size(); ++i)
      separate.push_back({ring.corner(i), ring.corner(ring.fan(i))});
    smallest = none;
  } else if (!ring.edges().empty())
    smallest = std::min(smallest, ring.edges().front().to());
  smallest_[vertex] = smallest;
}

std::int32_t EdgeConnectivity::components(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isMember,
                                          std::vector<CornerFan> separate, Execution& execution,
                                          std::vector<std::int32_t>& componentOfTriangle) const
{
  // A vertex is a node, or each of its fans one, where there are several.
  std::sort(separate.begin(), separate.end());
  std::vector<std::int32_t> firstCorners;
  for (const CornerFan& corner : separate)
    if (corner.corner == corner.fan)
      firstCorners.push_back(corner.fan);
  const auto nodeOf = [&](std::size_t triangle, std::size_t place) {
    const std::int32_t vertex = mesh.triangles[triangle][place];
    if (smallest_[vertex] != none)
      return static_cast<std::uint32_t>(vertex);
    const CornerFan key{static_cast<std::int32_t>(3 * triangle + place), 0};
    const std::int32_t fan = std::lower_bound(separate.begin(), separate.end(), key)->fan;
    const auto number = std::lower_bound(firstCorners.begin(), firstCorners.end(), fan) - firstCorners.begin();
    return static_cast<std::uint32_t>(smallest_.size() + static_cast<std::size_t>(number));
  };

  // Most vertices have a smaller neighbor: joining these leads to a few local minima, and little is left to join.
  DisjointSets nodes(smallest_.size() + firstCorners.size());
  for (std::size_t v = 0; v < smallest_.size(); ++v)
    if (smallest_[v] != none && smallest_[smallest_[v]] != none)
      nodes.join(static_cast<std::uint32_t>(v), static_cast<std::uint32_t>(smallest_[v]));
  const auto forMembers = [&](const auto& visit) {
    forEach(execution, mesh.triangles.size(), triangleGrain, [&](std::size_t t) {
      if ((isMember.empty() || isMember[t]) && hasValidIndices(mesh, t))
        visit(t);
    });
  };
  forMembers([&](std::size_t t) {
    const std::uint32_t first = nodeOf(t, 0);
    nodes.join(first, nodeOf(t, 1));
    nodes.join(first, nodeOf(t, 2));
  });
  componentOfTriangle.assign(mesh.triangles.size(), none);
  forMembers([&](std::size_t t) { componentOfTriangle[t] = static_cast<std::int32_t>(nodes.find(nodeOf(t, 0))); });

  std::int32_t count = 0;
  std::vector<std::int32_t> numbers(smallest_.size() + firstCorners.size(), none);
  for (std::int32_t& component : componentOfTriangle)
    if (component != none) {
      std::int32_t& number = numbers[component];
      if (number == none)
        number = count++;
      component = number;
    }
  return count;
}

std::int32_t groupTriangles(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isMember, Execution& execution,
                            std::vector<std::int32_t>& componentOfTriangle, bool& isTorn)
{
  const VertexCorners corners = groupCorners(mesh, isMember);
  EdgeConnectivity connectivity(mesh.vertices.size());
  struct Part {
    std::vector<CornerFan> separate;
    bool isTorn = false;
  };
  const auto parts = partsOf<Part, std::int32_t>(execution, mesh.vertices.size(), vertexGrain,
                                                 [&](Part& part, std::int32_t begin, std::int32_t end) {
                                                   Ring ring;
                                                   for (std::int32_t v = begin; v < end; ++v) {
                                                     if (corners.begin[v] == corners.begin[v + 1])
                                                       continue; // of members mostly a small part of the mesh
                                                     ring.set(mesh, corners, v);
                                                     if (!ring.isClosedFan()) {
                                                       ring.findEdges();
                                                       part.isTorn = ring.joinFans(false) > 1 || part.isTorn;
                                                     }
                                                     connectivity.note(v, ring, part.separate);
                                                   }
                                                 });
  isTorn = false;
  std::vector<CornerFan> separate;
  for (const Part& part : parts) {
    isTorn = isTorn || part.isTorn;
    separate.insert(separate.end(), part.separate.begin(), part.separate.end());
  }
  return connectivity.components(mesh, isMember, std::move(separate), execution, componentOfTriangle);
}

void splitFans(TriangleMesh& mesh)
{
  // What is to be split, in the order of the corners.
  std::vector<CornerFan> apart;
  {
    const VertexCorners corners = groupCorners(mesh);
    Ring ring;
    for (std::int32_t v = 0; v < static_cast<std::int32_t>(mesh.vertices.size()); ++v) {
      ring.set(mesh, corners, v);
      if (ring.isClosedFan())
        continue;
      ring.findEdges();
      if (ring.joinFans(false) < 2)
        continue;
      for (std::int32_t i = 0; i < ring.size(); ++i)
        if (ring.fan(i) != 0)
          apart.push_back({ring.corner(i), ring.corner(ring.fan(i))});
    }
  }
  std::sort(apart.begin(), apart.end());

  const auto vertexAt = [&](std::int32_t corner) -> std::int32_t& { return mesh.triangles[corner / 3][corner % 3]; };
  for (const CornerFan& corner : apart) {
    if (corner.corner != corner.fan) {
      vertexAt(corner.corner) = vertexAt(corner.fan); // has its copy already: a fan's first corner comes first
      continue;
    }
    const std::int32_t v = vertexAt(corner.corner);
    vertexAt(corner.corner) = static_cast<std::int32_t>(mesh.vertices.size());
    const auto copy = [v](auto& values) {
      if (!values.empty())
        values.push_back(typename std::decay_t<decltype(values)>::value_type(values[v]));
    };
    copy(mesh.vertices);
    copy(mesh.normals);
    copy(mesh.confidences);
    copy(mesh.sigmas);
    copy(mesh.calibrated);
  }
}

} // namespace pcl::mrf
