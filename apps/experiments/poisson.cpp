#include "poisson.h"

#include <pcl/surface/mrf/exceptions.h>

#include <pcl/point_types.h>
#include <pcl/surface/poisson.h>

namespace mrf_apps {

SurfaceMesh poisson(const std::vector<Eigen::Vector3d>& positions, const std::vector<Eigen::Vector3d>& normals,
                    int depth)
{
  const Eigen::Vector3d offset = positions.empty() ? Eigen::Vector3d::Zero() : positions.front();
  auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointNormal>>();
  cloud->reserve(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    pcl::PointNormal point;
    point.getVector3fMap() = (positions[i] - offset).cast<float>();
    point.getNormalVector3fMap() = normals[i].cast<float>();
    cloud->push_back(point);
  }
  pcl::Poisson<pcl::PointNormal> method;
  method.setDepth(depth);
  method.setInputCloud(cloud);
  pcl::PolygonMesh mesh;
  method.reconstruct(mesh);
  if (mesh.polygons.empty())
    throw pcl::mrf::InvalidInput("pcl::Poisson gave no surface");
  return toSurfaceMesh(mesh, offset);
}

} // namespace mrf_apps
