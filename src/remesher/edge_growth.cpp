// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/passes.h"

#include "base/loops.h"

#include <cstdint>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

namespace pcl::mrf {
namespace {

/// How much the sizing may grow per target edge of way.
constexpr float steepestGrowth = .2f;

} // namespace

void limitGrowth(const TriangleMesh& mesh, const VertexCorners& corners, float targetEdge, EdgeSizing& sizing,
                 Execution& execution)
{
  const auto limitFrom = [&](std::int32_t v, std::int32_t w) {
    return sizing[v] + steepestGrowth * (mesh.vertices[w] - mesh.vertices[v]).norm() / targetEdge;
  };
  const auto forNeighbors = [&](std::int32_t v, const auto& body) {
    for (std::int32_t n = corners.begin[v]; n < corners.begin[v + 1]; ++n)
      for (const std::int32_t w : mesh.triangles[corners.corners[n] / 3])
        if (w != v)
          body(w);
  };
  // Dijkstra's shortest paths, each vertex as far away at first as its sizing says, from those that limit another one.
  using Entry = std::pair<float, std::int32_t>;
  std::vector<Entry> entries;
  Poller poll(execution);
  for (std::int32_t v = 0; v < static_cast<std::int32_t>(sizing.size()); ++v) {
    poll();
    bool limits = false;
    forNeighbors(v, [&](std::int32_t w) { limits = limits || sizing[w] > limitFrom(v, w); });
    if (limits)
      entries.emplace_back(sizing[v], v);
  }
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue(std::greater<>(), std::move(entries));
  while (!queue.empty()) {
    poll();
    const auto [size, v] = queue.top();
    queue.pop();
    if (size > sizing[v])
      continue; // it was lowered since
    forNeighbors(v, [&, v = v](std::int32_t w) {
      const float limit = limitFrom(v, w);
      if (sizing[w] > limit) {
        sizing[w] = limit;
        queue.emplace(limit, w);
      }
    });
  }
}

} // namespace pcl::mrf
