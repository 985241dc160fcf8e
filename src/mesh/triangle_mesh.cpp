// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/triangle_mesh.h>

#include "base/select_values.h"

namespace pcl::mrf {

TriangleMesh select(const TriangleMesh& mesh, const std::vector<std::uint8_t>& keep)
{
  TriangleMesh kept;
  std::vector<std::uint8_t> used(mesh.vertices.size(), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (keep[t])
      for (const std::int32_t v : mesh.triangles[t])
        used[v] = 1;

  std::vector<std::int32_t> newIndex(mesh.vertices.size(), -1);
  std::int32_t count = 0;
  for (std::size_t v = 0; v < used.size(); ++v)
    if (used[v])
      newIndex[v] = count++;
  kept.vertices = selectValues(mesh.vertices, used);
  kept.normals = selectValues(mesh.normals, used);
  kept.confidences = selectValues(mesh.confidences, used);
  kept.sigmas = selectValues(mesh.sigmas, used);
  kept.calibrated = selectValues(mesh.calibrated, used);
  kept.triangles = selectValues(mesh.triangles, keep);
  for (Triangle& t : kept.triangles)
    t = {newIndex[t[0]], newIndex[t[1]], newIndex[t[2]]};
  return kept;
}

TriangleMesh displaced(TriangleMesh mesh, const std::vector<float>& distances)
{
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    mesh.vertices[v] += distances[v] * mesh.normals[v];
  return mesh;
}

} // namespace pcl::mrf
