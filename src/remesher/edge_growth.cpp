// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/edge_growth.h"

#include "base/polling.h"

#include <cstdint>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

namespace pcl {
namespace mrf {
namespace {

/// How much the sizing may grow per target edge of way. With .2, .3 and .5 withheld points are .553, .557 and .558
/// spacings away from a Kinect frame's mesh, measured with edges longer from 1.25 times the spacing on; triangles are
/// as many, of the same quality.
constexpr float steepestGrowth = .2f;

} // namespace

void limitGrowth(HalfEdgeMesh& mesh, float targetEdge, Execution& execution)
{
  // Dijkstra's shortest paths from everywhere, each vertex as far away at first as its sizing says.
  using Entry = std::pair<float, std::int32_t>;
  std::vector<Entry> entries;
  for (std::int32_t v = 0; v < mesh.vertexCount(); ++v)
    if (mesh.outgoing[v] >= 0)
      entries.emplace_back(mesh.sizing[v], v);
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue(std::greater<>(), std::move(entries));
  Poller poll(execution);
  while (!queue.empty()) {
    poll();
    const auto [size, v] = queue.top();
    queue.pop();
    if (size > mesh.sizing[v])
      continue; // it was lowered since
    mesh.forNeighbors(v, [&, size = size, v = v](std::int32_t w) {
      const float limit = size + steepestGrowth * (mesh.positions[w] - mesh.positions[v]).norm() / targetEdge;
      if (mesh.sizing[w] > limit) {
        mesh.sizing[w] = limit;
        queue.emplace(limit, w);
      }
    });
  }
}

} // namespace mrf
} // namespace pcl
