// SPDX-License-Identifier: BSD-3-Clause
#include "poisson.h"

#include "normal_cloud.h"

#include <pcl/surface/mrf/exceptions.h>

#include <pcl/surface/poisson.h>

namespace mrf_apps {

SurfaceMesh poisson(const std::vector<Eigen::Vector3d>& positions, const std::vector<Eigen::Vector3d>& normals,
                    int depth)
{
  const Eigen::Vector3d offset = positions.empty() ? Eigen::Vector3d::Zero() : positions.front();
  pcl::Poisson<pcl::PointNormal> method;
  method.setDepth(depth);
  method.setInputCloud(normalCloud(positions, normals, offset));
  pcl::PolygonMesh mesh;
  method.reconstruct(mesh);
  if (mesh.polygons.empty())
    throw pcl::mrf::InvalidInput("pcl::Poisson gave no surface");
  return toSurfaceMesh(mesh, offset);
}

} // namespace mrf_apps
