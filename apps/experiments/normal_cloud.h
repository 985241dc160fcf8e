// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Plain points as a cloud for PCL's own methods.
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Core>

#include <vector>

namespace mrf_apps {

/// The points with their normals in a frame about `offset`.
pcl::PointCloud<pcl::PointNormal>::Ptr normalCloud(const std::vector<Eigen::Vector3d>& positions,
                                                   const std::vector<Eigen::Vector3d>& normals,
                                                   const Eigen::Vector3d& offset);

} // namespace mrf_apps
