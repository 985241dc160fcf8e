// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/passes.h"

#include "base/loops.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

constexpr std::int64_t fittingGrain = 2048;
constexpr int fittingSteps = 5; ///< more steps gain nothing
/// Max move of a vertex, as a share of the target edge.
constexpr float farthest = .15f;
/// Height, as a share of the target edge, from which on an edge's midpoint counts nothing; the closer to it, the less
/// it counts (Tukey's biweight). An edge of the mesh across a sharp edge of the shape would raise its ends, bend the
/// flat surface beside the sharp edge, and fray it.
constexpr float ofSharpEdges = .25f;

/// Height of each edge's midpoint above the surface, stored for both half-edges.
std::vector<float> heightsOfMiddles(const RemeshedSurface& surface, Execution& execution)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  std::vector<float> heights(mesh.origin.size(), 0);
  forEachPolling<std::int32_t>(execution, mesh.halfEdgeCount(), fittingGrain, [&](std::int32_t h) {
    if (!mesh.represents(h))
      return;
    heights[h] = surface.level.height(.5f * (mesh.positions[mesh.origin[h]] + mesh.positions[mesh.target(h)]));
    if (mesh.twin[h] >= 0)
      heights[mesh.twin[h]] = heights[h];
  });
  return heights;
}

/// Moves each vertex by the weighted mean height of its edges. A midpoint rises by half of each end's move.
/// \param heights before any move \param moved move of each vertex so far, along its normal \return the new moves
std::vector<float> step(const RemeshedSurface& surface, const std::vector<float>& heights,
                        const std::vector<float>& moved, Execution& execution)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  std::vector<float> result(moved.size(), 0);
  forEachPolling<std::int32_t>(execution, mesh.vertexCount(), fittingGrain, [&](std::int32_t v) {
    if (mesh.pinned[v] || mesh.onBoundary(v))
      return;
    const float target = surface.targetAt(v), limit = farthest * target, sharp = ofSharpEdges * target;
    float sum = 0;
    mesh.forOutgoing(v, [&](std::int32_t h) {
      const float height = heights[h] + .5f * (moved[v] + moved[mesh.target(h)]);
      sum += height * squared(std::max(0.f, 1 - squared(height / sharp)));
    });
    result[v] = std::clamp(moved[v] - sum / static_cast<float>(mesh.valence[v]), -limit, limit);
  });
  return result;
}

} // namespace

void fitToSurface(RemeshedSurface& surface, Execution& execution)
{
  const std::vector<float> heights = heightsOfMiddles(surface, execution);
  std::vector<float> moved(surface.mesh.positions.size(), 0);
  for (int n = 0; n < fittingSteps; ++n)
    moved = step(surface, heights, moved, execution);
  Poller poll(execution);
  for (std::int32_t v = 0; v < surface.mesh.vertexCount(); ++v) {
    poll();
    const Corner fitted{surface.mesh.positions[v] + moved[v] * surface.mesh.normals[v], surface.mesh.normals[v]};
    if (moved[v] != 0 && surface.mayMove(v, fitted))
      surface.moveTo(v, {fitted});
  }
}

} // namespace pcl::mrf
