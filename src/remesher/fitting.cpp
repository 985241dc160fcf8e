// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/fitting.h"

#include "base/polling.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {
namespace {

using Eigen::Vector3f;

constexpr std::int64_t grain = 2048;
/// Accuracy of the scan igea_clean after none, three, five and eight: .0161, .0119, .0117, .0117 % of the diagonal; two
/// more are alike.
constexpr int steps = 5;
/// Share of the target edge that a vertex moves at most.
constexpr float farthest = .15f;
/// Share of the target edge from which on a height counts nothing, and the less the closer to it (Tukey's biweight):
/// that of a chord across a sharp edge of the shape would raise its ends, bend what is flat beside it, and fray the
/// edge. With .4 the faces of a machine part (fandisk) are a third farther from the truth, with .2 those of a bust with
/// folds (nefertiti) less well met.
constexpr float ofSharpEdges = .25f;

/// How high the middles of edges are above the surface, as far as it counts, at both half-edges of each.
std::vector<float> heightsOfMiddles(const RemeshedSurface& surface, const std::vector<Vector3f>& positions,
                                    Execution& execution)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  const float limit = ofSharpEdges * surface.targetEdge;
  std::vector<float> heights(mesh.origin.size(), 0);
  forRangePolling(execution, mesh.halfEdgeCount(), grain, [&](std::int64_t begin, std::int64_t end) {
    for (auto h = static_cast<std::int32_t>(begin); h < end; ++h) {
      if (!mesh.represents(h))
        continue;
      const Vector3f middle = .5f * (positions[mesh.origin[h]] + positions[mesh.target(h)]);
      const float height = surface.level.height(middle);
      heights[h] = height * squared(std::max(0.f, 1 - squared(height / limit)));
      if (mesh.twin[h] >= 0)
        heights[mesh.twin[h]] = heights[h];
    }
  });
  return heights;
}

/// Moves each vertex by the mean height of its edges. \param moved so far, along the normals
void step(const RemeshedSurface& surface, std::vector<float>& moved, std::vector<Vector3f>& positions,
          Execution& execution)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  const float limit = farthest * surface.targetEdge;
  const std::vector<float> heights = heightsOfMiddles(surface, positions, execution);
  forRangePolling(execution, mesh.vertexCount(), grain, [&](std::int64_t begin, std::int64_t end) {
    for (auto v = static_cast<std::int32_t>(begin); v < end; ++v) {
      if (mesh.pinned[v] || mesh.onBoundary(v))
        continue;
      float sum = 0;
      mesh.forOutgoing(v, [&](std::int32_t h) { sum += heights[h]; });
      moved[v] = std::clamp(moved[v] - sum / static_cast<float>(mesh.valence[v]), -limit, limit);
      positions[v] = mesh.positions[v] + moved[v] * mesh.normals[v];
    }
  });
}

} // namespace

void fitToSurface(RemeshedSurface& surface, Execution& execution)
{
  std::vector<Vector3f> positions = surface.mesh.positions;
  std::vector<float> moved(positions.size(), 0);
  for (int n = 0; n < steps; ++n)
    step(surface, moved, positions, execution);
  Poller poll(execution);
  for (std::int32_t v = 0; v < surface.mesh.vertexCount(); ++v) {
    poll();
    const Corner fitted{positions[v], surface.mesh.normals[v]};
    if (positions[v] != surface.mesh.positions[v] && surface.mayMove(v, fitted))
      surface.moveTo(v, {fitted});
  }
}

} // namespace mrf
} // namespace pcl
