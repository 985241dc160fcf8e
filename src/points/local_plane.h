// SPDX-License-Identifier: BSD-3-Clause
/// The plane of the points around a point (Section 3.1).
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace pcl::mrf {

/// Default number of nearest points, the point itself included, that a plane is fitted to.
constexpr int nearestNeighbors = 13;

struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(); ///< zero if the neighbors do not span a plane
  double thirdShare = 0;                            ///< third eigenvalue over the sum of the three
  double distance = 0;                              ///< of the point from the plane, cloud's unit
  double secondToFirst = 0, thirdToSecond = 0;      ///< ratios of eigenvalues

  /// The neighbors are spread widely enough to define a plane. secondToFirst is 1 for a disc, .28 for half a disc at a
  /// border, and nearly 0 for the nearest points of a lidar's ring, which lie on a line.
  bool isSound() const { return secondToFirst >= .1; }

  /// The noise is less than an eighth of the neighborhood's radius. Otherwise twice as many points average it.
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

  /// Fits the plane as pcl::NormalEstimation does, with PCL's closed form of the eigenvalues, but in double precision:
  /// single precision loses the middle eigenvalue, which tells lines from planes, and a small third one.
  Plane plane() const;

private:
  Eigen::Vector3d center_, sum_ = Eigen::Vector3d::Zero();
  double xx_ = 0, xy_ = 0, xz_ = 0, yy_ = 0, yz_ = 0, zz_ = 0;
  std::size_t count_ = 0;
};

/// The plane through the neighbors of a point. The neighbors include the point itself.
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
