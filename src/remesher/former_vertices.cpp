// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/former_vertices.h"

#include "base/loops.h"

#include <algorithm>
#include <iterator>

namespace pcl::mrf {

FormerVertices::FormerVertices(RemeshedSurface& surface)
    : surface_(surface), positions_(surface.mesh.positions), normals_(surface.mesh.normals),
      places_(surface.mesh.places)
{}

std::vector<std::int32_t> FormerVertices::takeBackWhatIntersects(const IntersectionWatch& watch, Execution& execution)
{
  HalfEdgeMesh& mesh = surface_.mesh;
  Poller poll(execution);
  while (true) {
    const std::vector<std::int32_t> corners = watch.newIntersections(mesh, execution);
    std::vector<std::int32_t> toReturn;
    std::copy_if(corners.begin(), corners.end(), std::back_inserter(toReturn),
                 [this](std::int32_t v) { return hasMoved(v); });
    if (toReturn.empty())
      return corners;
    while (!toReturn.empty()) {
      const std::int32_t v = toReturn.back();
      toReturn.pop_back();
      poll();
      if (!hasMoved(v))
        continue;
      takeBack(v);
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

} // namespace pcl::mrf
