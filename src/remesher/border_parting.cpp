// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/passes.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

/// True if triangles get no thinner than half their shape and do not turn over. Thinner ones are accepted, as only this
/// way removes them later. The field's normals do not count.
bool mayRetreat(const RemeshedSurface& surface, std::int32_t v, const Corner& moved)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  bool fits = true;
  mesh.forOutgoing(v, [&](std::int32_t h) {
    const TriangleShape former = surface.shape(h);
    const TriangleShape changed(moved, surface.corner(mesh.target(h)), surface.corner(mesh.opposite(h)));
    fits = fits && changed.shape > .5f * former.shape && changed.turnsLittle(former);
  });
  return fits;
}

/// Moves a vertex straight into its fan, which works even in a single triangle. Relaxation takes it to the zero level.
void retreat(RemeshedSurface& surface, std::int32_t v)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  Vector3f sum = Vector3f::Zero();
  mesh.forNeighbors(v, [&](std::int32_t w) { sum += mesh.positions[w] - mesh.positions[v]; });
  const Vector3f inwards = sum / static_cast<float>(mesh.valence[v]);
  for (const float share : {.3f, .15f, .05f}) {
    const Vector3f position = mesh.positions[v] + share * inwards;
    const Corner moved{position, surface.level.normalAt(position, mesh.normals[v])};
    if (mayRetreat(surface, v, moved)) {
      surface.moveTo(v, {moved});
      return;
    }
  }
}

} // namespace

std::vector<std::int32_t> sharingPlaces(const std::vector<Vector3f>& positions, std::vector<std::int32_t> vertices)
{
  std::stable_sort(vertices.begin(), vertices.end(), [&](std::int32_t v, std::int32_t w) {
    const Vector3f &p = positions[v], &q = positions[w];
    return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
  });
  const auto isAt = [&](std::size_t n, std::size_t other) {
    return other < vertices.size() && positions[vertices[n]] == positions[vertices[other]];
  };
  std::vector<std::int32_t> sharing;
  for (std::size_t n = 0; n < vertices.size(); ++n)
    if (isAt(n, n - 1) || isAt(n, n + 1))
      sharing.push_back(vertices[n]);
  return sharing;
}

void partBorders(RemeshedSurface& surface)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  std::vector<std::int32_t> border;
  for (std::int32_t v = 0; v < mesh.vertexCount(); ++v)
    if (mesh.onBoundary(v))
      border.push_back(v);
  for (const std::int32_t v : sharingPlaces(mesh.positions, std::move(border)))
    retreat(surface, v);
}

} // namespace pcl::mrf
