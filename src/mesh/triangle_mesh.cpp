// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/triangle_mesh.h>

#include <algorithm>

namespace pcl {
namespace mrf {

TriangleMesh select(const TriangleMesh& mesh, const std::vector<std::uint8_t>& keep)
{
  TriangleMesh kept;
  std::vector<std::uint8_t> used(mesh.vertices.size(), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (keep[t])
      for (const std::int32_t v : mesh.triangles[t])
        used[static_cast<std::size_t>(v)] = 1;

  // Sized beforehand: growing by doubling would take half as much memory again.
  const auto vertices = static_cast<std::size_t>(std::count(used.begin(), used.end(), 1));
  kept.vertices.reserve(vertices);
  kept.normals.reserve(mesh.normals.empty() ? 0 : vertices);
  kept.confidences.reserve(mesh.confidences.empty() ? 0 : vertices);
  kept.triangles.reserve(keep.size() - static_cast<std::size_t>(std::count(keep.begin(), keep.end(), 0)));
  std::vector<std::int32_t> newIndex(mesh.vertices.size(), -1);
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (!used[v])
      continue;
    newIndex[v] = static_cast<std::int32_t>(kept.vertices.size());
    kept.vertices.push_back(mesh.vertices[v]);
    if (!mesh.normals.empty())
      kept.normals.push_back(mesh.normals[v]);
    if (!mesh.confidences.empty())
      kept.confidences.push_back(mesh.confidences[v]);
    if (!mesh.sigmas.empty())
      kept.sigmas.push_back(mesh.sigmas[v]);
    if (!mesh.calibrated.empty())
      kept.calibrated.push_back(mesh.calibrated[v]);
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!keep[t])
      continue;
    const Triangle& old = mesh.triangles[t];
    kept.triangles.push_back({newIndex[static_cast<std::size_t>(old[0])], newIndex[static_cast<std::size_t>(old[1])],
                              newIndex[static_cast<std::size_t>(old[2])]});
  }
  return kept;
}

TriangleMesh displaced(TriangleMesh mesh, const std::vector<float>& distances)
{
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    mesh.vertices[v] += distances[v] * mesh.normals[v];
  return mesh;
}

} // namespace mrf
} // namespace pcl
