// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/passes.h"

#include "base/loops.h"

#include <cstdint>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

namespace pcl {
namespace mrf {
namespace {

/// How much the sizing may grow per target edge of way.
constexpr float steepestGrowth = .2f;

} // namespace

void limitGrowth(HalfEdgeMesh& mesh, float targetEdge, Execution& execution)
{
  const auto limitFrom = [&](std::int32_t v, std::int32_t w) {
    return mesh.sizing[v] + steepestGrowth * (mesh.positions[w] - mesh.positions[v]).norm() / targetEdge;
  };
  // Dijkstra's shortest paths, each vertex as far away at first as its sizing says, from those that limit another one.
  using Entry = std::pair<float, std::int32_t>;
  std::vector<Entry> entries;
  Poller poll(execution);
  for (std::int32_t v = 0; v < mesh.vertexCount(); ++v) {
    poll();
    if (mesh.outgoing[v] < 0)
      continue;
    bool limits = false;
    mesh.forNeighbors(v, [&](std::int32_t w) { limits = limits || mesh.sizing[w] > limitFrom(v, w); });
    if (limits)
      entries.emplace_back(mesh.sizing[v], v);
  }
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue(std::greater<>(), std::move(entries));
  while (!queue.empty()) {
    poll();
    const auto [size, v] = queue.top();
    queue.pop();
    if (size > mesh.sizing[v])
      continue; // it was lowered since
    mesh.forNeighbors(v, [&, v = v](std::int32_t w) {
      const float limit = limitFrom(v, w);
      if (mesh.sizing[w] > limit) {
        mesh.sizing[w] = limit;
        queue.emplace(limit, w);
      }
    });
  }
}

} // namespace mrf
} // namespace pcl
