// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/predicates.h"

#include <boost/multiprecision/cpp_bin_float.hpp>

#include <cmath>

namespace pcl::mrf {
namespace {

/// Max rounding error of a determinant in double, relative to the sum of the magnitudes of its terms: seven roundings
/// of 2⁻⁵³ in the longest chain, rounded up.
constexpr double filter = 1e-15;

/// Exact for sums of products of three differences of coordinates, which are multiples of 2⁻⁵³ of the largest one.
using Exact =
    boost::multiprecision::number<boost::multiprecision::cpp_bin_float<256, boost::multiprecision::digit_base_2>,
                                  boost::multiprecision::et_off>;

template <typename Real>
int signOf(const Real& value)
{
  return (value > 0) - (value < 0);
}

int exactOrientation(const Eigen::Vector3d& u, const Eigen::Vector3d& v, const Eigen::Vector3d& w)
{
  const auto minor = [&](int i, int j) -> Exact { return Exact(v[i]) * w[j] - Exact(v[j]) * w[i]; };
  return signOf<Exact>(u.x() * minor(1, 2) + u.y() * minor(2, 0) + u.z() * minor(0, 1));
}

} // namespace

int orientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& d)
{
  const Eigen::Vector3d u = b - a, v = c - a, w = d - a;
  const double vywz = v.y() * w.z(), vzwy = v.z() * w.y();
  const double vzwx = v.z() * w.x(), vxwz = v.x() * w.z();
  const double vxwy = v.x() * w.y(), vywx = v.y() * w.x();
  const double determinant = u.x() * (vywz - vzwy) + u.y() * (vzwx - vxwz) + u.z() * (vxwy - vywx);
  const double magnitude = std::abs(u.x()) * (std::abs(vywz) + std::abs(vzwy)) +
                           std::abs(u.y()) * (std::abs(vzwx) + std::abs(vxwz)) +
                           std::abs(u.z()) * (std::abs(vxwy) + std::abs(vywx));
  if (std::abs(determinant) > filter * magnitude)
    return signOf(determinant);
  return magnitude > 0 ? exactOrientation(u, v, w) : 0;
}

int orientation(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c)
{
  const Eigen::Vector2d u = b - a, v = c - a;
  const double left = u.x() * v.y(), right = u.y() * v.x();
  const double determinant = left - right;
  if (std::abs(determinant) > filter * (std::abs(left) + std::abs(right)))
    return signOf(determinant);
  return signOf<Exact>(Exact(u.x()) * v.y() - Exact(u.y()) * v.x());
}

} // namespace pcl::mrf
