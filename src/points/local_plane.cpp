// SPDX-License-Identifier: BSD-3-Clause
#include "points/local_plane.h"

#include <pcl/common/eigen.h>

#include <algorithm>

namespace pcl::mrf {

Plane PlaneMoments::plane() const
{
  // Neighbors lie on a line if the second eigenvalue is at most this share of the first, that is, if they are 10⁴
  // times as long as wide. Rounding to single precision makes a short line of a cloud about that wide.
  constexpr double collinear = 1e-8;
  Plane plane;
  if (count_ < 3)
    return plane;
  const double share = 1 / static_cast<double>(count_);
  const Eigen::Vector3d mean = share * sum_;
  Eigen::Matrix3d covariance;
  covariance << xx_, xy_, xz_, xy_, yy_, yz_, xz_, yz_, zz_;
  covariance = share * covariance - mean * mean.transpose();
  const double scale = covariance.trace();
  if (!(scale > 0))
    return plane;
  // Scaled to unit trace, because PCL's closed form of the eigenvalues compares with absolute limits.
  covariance /= scale;
  Eigen::Vector3d values;
  eigen33(covariance, values);
  if (!(values[1] > collinear * values[2]))
    return plane;
  Eigen::Vector3d normal;
  computeCorrespondingEigenVector(covariance, values[0], normal);
  if (!normal.allFinite())
    return plane;
  plane.normal = normal;
  plane.thirdShare = std::max(values[0], 0.0);
  plane.distance = std::abs(normal.dot(mean));
  plane.secondToFirst = values[1] / values[2];
  plane.thirdToSecond = plane.thirdShare / values[1];
  return plane;
}

} // namespace pcl::mrf
