// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/mesh_topology.h"

#include <pcl/surface/mrf/exceptions.h>

#include <limits>
#include <numeric>
#include <string>
#include <type_traits>
#include <utility>

namespace pcl::mrf {

VertexCorners groupCorners(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isMember, std::size_t first,
                           std::size_t count)
{
  if (mesh.triangles.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max() / 3))
    throw ResourceLimit("the mesh has " + std::to_string(mesh.triangles.size()) +
                        " triangles, more than 32-bit indices can tell apart; use larger voxels");
  count = std::min(count, mesh.vertices.size() - first);
  const auto forMembers = [&](const auto& visit) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      if ((isMember.empty() || isMember[t]) && hasValidIndices(mesh, t))
        for (std::size_t i = 0; i < 3; ++i)
          if (const std::size_t n = mesh.triangles[t][i] - first; n < count) // smaller ones wrap around
            visit(n, static_cast<std::int32_t>(3 * t + i));
  };
  VertexCorners result;
  // begin[n + 1] is first the begin of vertex n. Filling moves it to the end of vertex n.
  result.begin.assign(count + 2, 0);
  forMembers([&](std::size_t n, std::int32_t) { ++result.begin[n + 2]; });
  std::partial_sum(result.begin.begin(), result.begin.end(), result.begin.begin());
  result.corners.resize(result.begin.back());
  forMembers([&](std::size_t n, std::int32_t corner) { result.corners[result.begin[n + 1]++] = corner; });
  result.begin.pop_back();
  result.first = static_cast<std::int32_t>(first);
  return result;
}

void Ring::set(const TriangleMesh& mesh, const VertexCorners& corners, std::int32_t vertex)
{
  const std::int32_t* begin = &corners.begin[vertex - corners.first];
  corners_ = corners.corners.data() + *begin;
  const std::int32_t count = begin[1] - *begin;
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
  // If the walk comes back to the first triangle after exactly `count` steps, it has visited every triangle once.
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
    fans_[i] = fans_[fans_[i]]; // the fan's first triangle came before and is final
    count += fans_[i] == i ? 1 : 0;
  }
  return count;
}

void joinTriangles(Ring& ring, DisjointSets& triangles)
{
  const bool isClosedFan = ring.isClosedFan();
  if (!isClosedFan)
    ring.joinFans(true);
  for (std::int32_t i = 1; i < ring.size(); ++i)
    triangles.join(ring.corner(i) / 3, ring.corner(isClosedFan ? 0 : ring.fan(i)) / 3);
}

std::int32_t numberComponents(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isMember,
                              DisjointSets& triangles, Execution& execution,
                              std::vector<std::int32_t>& componentOfTriangle)
{
  componentOfTriangle.assign(mesh.triangles.size(), -1);
  forTriangles(mesh, execution, [&](std::size_t t) {
    if ((isMember.empty() || isMember[t]) && hasValidIndices(mesh, t))
      componentOfTriangle[t] = static_cast<std::int32_t>(triangles.find(static_cast<std::uint32_t>(t)));
  });
  std::int32_t count = 0;
  for (std::size_t t = 0; t < componentOfTriangle.size(); ++t)
    if (std::int32_t& component = componentOfTriangle[t]; component >= 0) // the first triangle of t's component
      component = static_cast<std::size_t>(component) == t ? count++ : componentOfTriangle[component];
  return count;
}

std::int32_t groupTriangles(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isMember, Execution& execution,
                            std::vector<std::int32_t>& componentOfTriangle, bool& isTorn)
{
  DisjointSets triangles(mesh.triangles.size());
  const auto torn =
      partsOfRings<std::uint8_t>(mesh, isMember, execution, [&](std::uint8_t& isAnyTorn, Ring& ring, int) {
        if (!ring.isClosedFan()) {
          ring.findEdges();
          if (ring.joinFans(false) > 1)
            isAnyTorn = 1;
        }
        joinTriangles(ring, triangles);
      });
  isTorn = std::find(torn.begin(), torn.end(), std::uint8_t{1}) != torn.end();
  return numberComponents(mesh, isMember, triangles, execution, componentOfTriangle);
}

void splitFans(TriangleMesh& mesh)
{
  // Pairs of a corner to be split off and the first corner of its fan.
  std::vector<std::pair<std::int32_t, std::int32_t>> apart;
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
          apart.emplace_back(ring.corner(i), ring.corner(ring.fan(i)));
    }
  }
  std::sort(apart.begin(), apart.end());

  const auto vertexAt = [&](std::int32_t corner) -> std::int32_t& { return mesh.triangles[corner / 3][corner % 3]; };
  for (const auto& [corner, fan] : apart) {
    if (corner != fan) {
      vertexAt(corner) = vertexAt(fan); // has the copy already: the first corner of a fan comes first
      continue;
    }
    const std::int32_t v = vertexAt(corner);
    vertexAt(corner) = static_cast<std::int32_t>(mesh.vertices.size());
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
