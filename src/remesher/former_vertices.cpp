// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/former_vertices.h"

#include "base/polling.h"

namespace pcl {
namespace mrf {

FormerVertices::FormerVertices(RemeshedSurface& surface)
    : surface_(surface), positions_(surface.mesh.positions), normals_(surface.mesh.normals),
      places_(surface.mesh.places)
{}

std::vector<std::int32_t> FormerVertices::takeBackWhatIntersects(const IntersectionWatch& watch, Execution& execution)
{
  const HalfEdgeMesh& mesh = surface_.mesh;
  Poller poll(execution);
  std::vector<std::uint8_t> changed; // since the last look, and what intersected then
  while (true) {
    std::vector<std::int32_t> corners = changeableCorners(mesh, watch.intersectingTriangles(mesh, changed, execution));
    if (corners.empty())
      return {};
    changed.assign(mesh.positions.size(), 0);
    std::vector<std::int32_t> toReturn;
    for (const std::int32_t v : corners) {
      changed[v] = 1;
      if (hasMoved(v))
        toReturn.push_back(v);
    }
    if (toReturn.empty())
      return corners;
    while (!toReturn.empty()) {
      const std::int32_t v = toReturn.back();
      toReturn.pop_back();
      poll();
      if (!hasMoved(v))
        continue;
      takeBack(v);
      changed[v] = 1;
      mesh.forOutgoing(v, [&](std::int32_t h) {
        if (!surface_.shape(h).sound())
          toReturn.insert(toReturn.end(), {mesh.target(h), mesh.opposite(h)});
      });
    }
  }
}

bool FormerVertices::hasMoved(std::int32_t v) const
{
  return surface_.mesh.positions[v] != positions_[v];
}

void FormerVertices::takeBack(std::int32_t v)
{
  surface_.moveTo(v, {{positions_[v], normals_[v]}, places_.empty() ? -1 : places_[v]});
  ++surface_.result.refusedOperations;
}

} // namespace mrf
} // namespace pcl
