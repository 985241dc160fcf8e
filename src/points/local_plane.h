// SPDX-License-Identifier: BSD-3-Clause
/// The plane of the points around a point (Section 3.1).
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace pcl::mrf {

/// Points nearest to a point, itself included, that tell its normal where nothing speaks for more.
constexpr int nearestNeighbors = 13;

struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(); ///< zero if the neighbors do not span a plane
  double thirdShare = 0;                            ///< of the third eigenvalue in their sum
  double distance = 0;                              ///< from the point, cloud's unit
  double secondToFirst = 0, thirdToSecond = 0;      ///< ratios of eigenvalues

  /// As wide as a plane needs. A disc has 1, a half one at a border .28; the nearest points of a lidar's ring, of one
  /// line, have next to nothing.
  bool isSound() const { return secondToFirst >= .1; }

  /// Noise of less than an eighth of its radius. Twice as many points average the noise of one that is not flat.
  bool isFlat() const { return thirdToSecond < 1. / 16; }
};

/// First and second moments of points about one of them.
class PlaneMoments {
public:
  explicit PlaneMoments(const Eigen::Vector3f& position) : center_(position.cast<double>()) {}

  void add(const Eigen::Vector3f& neighbor)
  {
    // Relative to the point itself, so that nothing is lost far from the origin.
    const Eigen::Vector3d p = neighbor.cast<double>() - center_;
    ++count_;
    sum_ += p;
    xx_ += p.x() * p.x();
    xy_ += p.x() * p.y();
    xz_ += p.x() * p.z();
    yy_ += p.y() * p.y();
    yz_ += p.y() * p.z();
    zz_ += p.z() * p.z();
  }

  /// What pcl::NormalEstimation does per point, with PCL's closed form of the eigenvalues, but in double precision: its
  /// own single precision loses the middle eigenvalue, which tells lines from planes, and small third ones.
  Plane plane() const;

private:
  Eigen::Vector3d center_, sum_ = Eigen::Vector3d::Zero();
  double xx_ = 0, xy_ = 0, xz_ = 0, yy_ = 0, yz_ = 0, zz_ = 0;
  std::size_t count_ = 0;
};

/// The plane of neighbors, the point itself among them.
template <typename Index>
Plane fitPlane(const std::vector<Eigen::Vector3f>& positions, const Index* neighbors, std::size_t count,
               const Eigen::Vector3f& position)
{
  PlaneMoments moments(position);
  for (std::size_t n = 0; n < count; ++n)
    moments.add(positions[neighbors[n]]);
  return moments.plane();
}

} // namespace pcl::mrf
