// SPDX-License-Identifier: BSD-3-Clause
#include "base/disjoint_sets.h"
#include "base/loops.h"
#include "mesh/mesh_topology.h"
#include "mesh/vertex_fields.h"
#include "trimming/trimming.h"

#include <pcl/surface/mrf/triangle_mesh.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

namespace pcl::mrf {
namespace {

/// An edge is cut at least this share of its length away from its ends, so that no triangle vanishes.
constexpr float minShareOfEdge = .1f;

constexpr std::int64_t queryGrain = 256;

/// Where a position lies beside the points around it, along the surface.
struct Surroundings {
  float margin = 0;       ///< distance to the border of the points, .6 spacings outside of the last ones; > 0: within
  Eigen::Vector3f inward; ///< direction of the points' mean
  bool isAmidst = false;  ///< whether points lie to both sides
};

/// \param scratch for the search
Surroundings surroundingsOf(const Eigen::Vector3f& position, const Support& support, Neighbors& scratch)
{
  constexpr float around = 3;    // in reaches: the next ring of a lidar is at most two away
  constexpr float outside = .6f; // of a spacing: a point stands for surface half way to where the next would be
  const OrientedPoints& points = support.points();
  if (support.search().nearest(position, 1, scratch) < 1)
    return {0, Eigen::Vector3f::Zero(), false};
  const std::size_t nearest = scratch.indices[0];
  const float distance = std::sqrt(scratch.squaredDistances[0]), reach = support.reach(nearest);
  support.search().within(position, distance + around * reach, scratch);
  const auto wayTo = [&](std::size_t point) -> Eigen::Vector3f {
    const Eigen::Vector3f way = points.positions[point] - position;
    return way - way.dot(points.normals[nearest]) * points.normals[nearest];
  };
  Eigen::Vector3f inward = Eigen::Vector3f::Zero();
  for (const int point : scratch.indices)
    inward += wayTo(point);
  inward.normalize();
  float first = wayTo(nearest).dot(inward);
  bool isAmidst = false;
  for (const int point : scratch.indices) {
    const Eigen::Vector3f way = wayTo(point);
    const float ahead = way.dot(inward);
    isAmidst = isAmidst || ahead < 0;
    if ((way - ahead * inward).squaredNorm() < reach * reach)
      first = std::min(first, ahead);
  }
  const float within = (points.spacings.empty() ? 0 : outside * points.spacings[nearest]) - first;
  return {distance < reach ? within : std::min(within, reach - distance), inward, isAmidst};
}

class BorderTightener {
public:
  BorderTightener(TriangleMesh& mesh, const Support& support)
      : mesh_(mesh), support_(support), states_(mesh.vertices.size(), State::unknown)
  {}

  std::int64_t run(Execution& execution)
  {
    findBeyond(execution);
    std::vector<Triangle> triangles;
    std::int64_t changed = 0;
    for (const Triangle& t : mesh_.triangles) {
      const std::int64_t beyond = std::count_if(t.begin(), t.end(), [&](std::int32_t v) { return isBeyond(v); });
      changed += beyond > 0 ? 1 : 0;
      if (beyond == 0)
        triangles.push_back(t);
      else if (beyond < 3)
        cut(t, beyond == 1, triangles);
    }
    if (changed == 0)
      return 0;
    mesh_.triangles = std::move(triangles);
    mesh_ = select(mesh_, std::vector<std::uint8_t>(mesh_.triangles.size(), 1));
    return changed;
  }

private:
  enum class State : std::uint8_t { unknown, kept, beyond };

  /// False for the vertices of edges that were cut.
  bool isBeyond(std::int32_t vertex) const
  {
    return static_cast<std::size_t>(vertex) < states_.size() && states_[vertex] == State::beyond;
  }

  /// Finds the vertices beyond the border of the points: from the mesh's borders and from fillings inward, ring by
  /// ring, up to that border. Those that are reached from a filling first stay: else it would come off.
  void findBeyond(Execution& execution)
  {
    const VertexCorners corners = groupCorners(mesh_);
    const std::vector<std::int32_t> border = findBorder(corners);
    std::vector<std::int32_t> ring;
    const auto add = [&](std::int32_t vertex, State state) {
      if (states_[vertex] != State::unknown)
        return;
      states_[vertex] = state;
      ring.push_back(vertex);
    };
    const auto addAround = [&](std::int32_t vertex) {
      for (std::int32_t c = corners.begin[vertex]; c < corners.begin[vertex + 1]; ++c)
        for (const std::int32_t other : mesh_.triangles[corners.corners[c] / 3])
          add(other, states_[vertex]);
    };
    for (const std::int32_t vertex : keepFillings(border, execution))
      addAround(vertex);
    for (const std::int32_t vertex : border)
      add(vertex, State::beyond);
    while (!ring.empty()) {
      std::vector<Surroundings> found(ring.size());
      forEachPolling(execution, static_cast<std::int64_t>(ring.size()), queryGrain, [&](std::size_t n) {
        Neighbors scratch;
        found[n] = surroundingsOf(mesh_.vertices[ring[n]], support_, scratch);
      });
      const std::vector<std::int32_t> reached = std::exchange(ring, {});
      for (std::size_t n = 0; n < reached.size(); ++n) {
        surroundings_[reached[n]] = found[n];
        if (found[n].margin < 0)
          addAround(reached[n]);
        else
          states_[reached[n]] = State::kept;
      }
    }
    keepStrips();
  }

  /// Keeps both ends of edges that cross a strip of points which is narrower than they are long.
  void keepStrips()
  {
    constexpr float opposite = -.5f; // cosine of the directions inward
    std::vector<std::int32_t> across;
    for (const Triangle& t : mesh_.triangles)
      for (std::size_t n = 0; n < t.size(); ++n)
        if (const std::int32_t a = t[n], b = t[(n + 1) % t.size()]; isBeyond(a) && isBeyond(b))
          if (surroundings_.at(a).inward.dot(surroundings_.at(b).inward) < opposite)
            across.insert(across.end(), {a, b});
    for (const std::int32_t v : across)
      states_[v] = State::kept;
  }

  std::vector<std::int32_t> findBorder(const VertexCorners& corners) const
  {
    std::vector<std::int32_t> border;
    Ring ring;
    for (std::int32_t v = 0; v < static_cast<std::int32_t>(mesh_.vertices.size()); ++v) {
      ring.set(mesh_, corners, v);
      if (ring.isClosedFan())
        continue;
      ring.findEdges();
      const auto endsMesh = [](const Ring::Edge& edge) { return edge.sides() == 1; };
      if (std::any_of(ring.edges().begin(), ring.edges().end(), endsMesh))
        border.push_back(v);
    }
    return border;
  }

  /// Keeps the fillings at the mesh's border, regions of triangles without support, that have points to both sides of
  /// some vertex; the others stick out of the surface. \return the vertices of those that are kept
  std::vector<std::int32_t> keepFillings(const std::vector<std::int32_t>& border, Execution& execution)
  {
    DisjointSets regions(mesh_.vertices.size());
    std::vector<std::uint8_t> isFilling(mesh_.vertices.size(), 0), isAtBorder(mesh_.vertices.size(), 0);
    const auto isSupported = [&](std::int32_t v) { return mesh_.confidences[v] > 0; };
    for (const Triangle& t : mesh_.triangles)
      if (std::none_of(t.begin(), t.end(), isSupported)) {
        regions.join(t[0], t[1]);
        regions.join(t[0], t[2]);
        isFilling[t[0]] = isFilling[t[1]] = isFilling[t[2]] = 1;
      }
    for (const std::int32_t v : border)
      isAtBorder[regions.find(v)] = 1;
    std::vector<std::int32_t> vertices;
    for (std::int32_t v = 0; v < static_cast<std::int32_t>(isFilling.size()); ++v)
      if (isFilling[v] && isAtBorder[regions.find(v)])
        vertices.push_back(v);
    std::vector<std::atomic<bool>> isKept(mesh_.vertices.size());
    forEachPolling(execution, static_cast<std::int64_t>(vertices.size()), queryGrain, [&](std::size_t n) {
      Neighbors scratch;
      std::atomic<bool>& ofRegion = isKept[regions.find(vertices[n])];
      if (!ofRegion && surroundingsOf(mesh_.vertices[vertices[n]], support_, scratch).isAmidst)
        ofRegion = true;
    });
    vertices.erase(
        std::remove_if(vertices.begin(), vertices.end(), [&](std::int32_t v) { return !isKept[regions.find(v)]; }),
        vertices.end());
    for (const std::int32_t v : vertices)
      states_[v] = State::kept;
    return vertices;
  }

  /// Adds what is left of a triangle with one or two corners beyond the border.
  void cut(Triangle t, bool isOneBeyond, std::vector<Triangle>& triangles)
  {
    while (isBeyond(t[0]) != isOneBeyond || isBeyond(t[1]) == isOneBeyond || isBeyond(t[2]) == isOneBeyond)
      std::rotate(t.begin(), t.begin() + 1, t.end());
    if (isOneBeyond) {
      const std::int32_t first = cutEdge(t[0], t[1]), last = cutEdge(t[0], t[2]);
      triangles.push_back({first, t[1], t[2]});
      triangles.push_back({first, t[2], last});
    } else {
      const std::int32_t first = cutEdge(t[1], t[0]), last = cutEdge(t[2], t[0]);
      triangles.push_back({t[0], first, last});
    }
  }

  /// \return a vertex where the margin vanishes on an edge, if it is linear
  std::int32_t cutEdge(std::int32_t beyond, std::int32_t kept)
  {
    const auto [entry, isNew] = cuts_.try_emplace(static_cast<std::int64_t>(beyond) << 32 | kept,
                                                  static_cast<std::int32_t>(mesh_.vertices.size()));
    if (!isNew)
      return entry->second;
    const auto marginOf = [&](std::int32_t vertex) {
      const auto found = surroundings_.find(vertex);
      return found == surroundings_.end() ? 0 : found->second.margin;
    };
    const float outside = marginOf(beyond), inside = std::max(marginOf(kept), 0.f);
    const float share = std::clamp(outside / (outside - inside), minShareOfEdge, 1 - minShareOfEdge);
    const auto addBetween = [&](auto& values) {
      if (!values.empty())
        values.push_back(values[beyond] + share * (values[kept] - values[beyond]));
    };
    addBetween(mesh_.vertices);
    addBetween(mesh_.normals);
    addBetween(mesh_.confidences);
    return entry->second;
  }

  TriangleMesh& mesh_;
  const Support& support_;
  std::unordered_map<std::int32_t, Surroundings> surroundings_; ///< by vertex, as far as they were asked for
  std::vector<State> states_;                                   ///< by vertex
  std::unordered_map<std::int64_t, std::int32_t> cuts_;         ///< by the ends of an edge
};

} // namespace

std::int64_t tightenBorders(TriangleMesh& mesh, const Support& support, Execution& execution)
{
  return BorderTightener(mesh, support).run(execution);
}

} // namespace pcl::mrf
