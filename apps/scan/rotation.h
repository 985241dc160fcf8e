// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Rotations about x, then y, then z, in degrees.
#pragma once

#include <Eigen/Geometry>

namespace pcl::mrf::scan {

inline Eigen::Matrix3d rotationOf(const Eigen::Vector3d& degrees)
{
  using Eigen::AngleAxisd;
  const Eigen::Vector3d angles = degrees * EIGEN_PI / 180;
  return (AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()) * AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
          AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

inline Eigen::Vector3d rotate(const Eigen::Vector3d& degrees, const Eigen::Vector3d& x)
{
  return degrees.isZero(0) ? x : Eigen::Vector3d(rotationOf(degrees) * x);
}

inline Eigen::Vector3d rotateBack(const Eigen::Vector3d& degrees, const Eigen::Vector3d& x)
{
  return degrees.isZero(0) ? x : Eigen::Vector3d(rotationOf(degrees).transpose() * x);
}

} // namespace pcl::mrf::scan
