// SPDX-License-Identifier: BSD-3-Clause
#include "hoppe.h"

#include "normal_cloud.h"

#include <pcl/surface/mrf/exceptions.h>

#include <pcl/surface/marching_cubes_hoppe.h>

#include <cmath>
#include <unordered_map>

namespace mrf_apps {

using Eigen::Vector3d;

SurfaceMesh mergeClose(const SurfaceMesh& mesh, double distance)
{
  // Vertices that survive, by the cube that they lie in. All within the distance lie in one of the 8 cubes around.
  const double side = 4 * distance;
  std::unordered_multimap<std::uint64_t, std::int32_t> cubes;
  const auto keyOf = [&](const Vector3d& place) {
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis)
      key = key * 0x9E3779B97F4A7C15u + static_cast<std::uint64_t>(std::llround(std::floor(place[axis] / side)));
    return key;
  };
  SurfaceMesh result;
  std::vector<std::int32_t> indices(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vector3d& vertex = mesh.vertices[v];
    std::int32_t found = -1;
    if (vertex.allFinite())
      for (int corner = 0; corner < 8 && found < 0; ++corner) {
        const Vector3d step(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
        const auto range = cubes.equal_range(keyOf(vertex + distance * step));
        for (auto other = range.first; other != range.second && found < 0; ++other)
          if ((result.vertices[static_cast<std::size_t>(other->second)] - vertex).norm() <= distance)
            found = other->second;
      }
    if (found < 0) {
      found = static_cast<std::int32_t>(result.vertices.size());
      result.vertices.push_back(vertex);
      if (vertex.allFinite())
        cubes.emplace(keyOf(vertex), found);
    }
    indices[v] = found;
  }
  for (const auto& triangle : mesh.triangles) {
    const std::int32_t a = indices[static_cast<std::size_t>(triangle[0])],
                       b = indices[static_cast<std::size_t>(triangle[1])],
                       c = indices[static_cast<std::size_t>(triangle[2])];
    if (a != b && b != c && c != a)
      result.triangles.push_back({a, b, c});
  }
  return result;
}

SurfaceMesh marchingCubesHoppe(const std::vector<Vector3d>& positions, const std::vector<Vector3d>& normals,
                               int resolution)
{
  const Vector3d offset = positions.empty() ? Vector3d::Zero() : positions.front();
  Eigen::AlignedBox3d box;
  for (const Vector3d& position : positions)
    box.extend(position);
  pcl::MarchingCubesHoppe<pcl::PointNormal> method;
  method.setGridResolution(resolution, resolution, resolution);
  method.setPercentageExtendGrid(.05f);
  method.setIsoLevel(0);
  method.setInputCloud(normalCloud(positions, normals, offset));
  pcl::PolygonMesh mesh;
  method.reconstruct(mesh);
  if (mesh.polygons.empty())
    throw pcl::mrf::InvalidInput("pcl::MarchingCubesHoppe gave no surface");
  // Some roundings of float; the cells are thousands of times larger.
  return mergeClose(toSurfaceMesh(mesh, offset), 1e-6 * box.diagonal().norm());
}

} // namespace mrf_apps
