// SPDX-License-Identifier: BSD-3-Clause
#include "normal_cloud.h"

namespace mrf_apps {

pcl::PointCloud<pcl::PointNormal>::Ptr normalCloud(const std::vector<Eigen::Vector3d>& positions,
                                                   const std::vector<Eigen::Vector3d>& normals,
                                                   const Eigen::Vector3d& offset)
{
  auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointNormal>>();
  cloud->reserve(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    pcl::PointNormal point;
    point.getVector3fMap() = (positions[i] - offset).cast<float>();
    point.getNormalVector3fMap() = normals[i].cast<float>();
    cloud->push_back(point);
  }
  return cloud;
}

} // namespace mrf_apps
