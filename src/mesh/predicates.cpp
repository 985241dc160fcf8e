// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/predicates.h"

#include <array>
#include <cmath>

namespace pcl::mrf {
namespace {

/// Bound on the relative rounding error of the double evaluations, against the sum of the terms' magnitudes: seven
/// roundings of 2⁻⁵³ in the longest chain, rounded up.
constexpr double filter = 1e-15;

int signOf(double value)
{
  return (value > 0) - (value < 0);
}

/// An exact sum: doubles that do not overlap, in growing order of magnitude.
class ExactSum {
public:
  void add(double value)
  {
    for (int i = 0; i < size_; ++i) {
      const double sum = value + terms_[i];
      const double part = sum - value;
      terms_[i] = (value - (sum - part)) + (terms_[i] - part);
      value = sum;
    }
    terms_[size_++] = value;
  }

  void addProduct(double x, double y)
  {
    const double product = x * y;
    add(std::fma(x, y, -product));
    add(product);
  }

  void addProduct(double x, double y, double z)
  {
    const double product = x * y;
    addProduct(std::fma(x, y, -product), z);
    addProduct(product, z);
  }

  /// The largest term that is not zero outweighs all the others together.
  int sign() const
  {
    for (int i = size_; i-- > 0;)
      if (terms_[i] != 0)
        return signOf(terms_[i]);
    return 0;
  }

private:
  std::array<double, 24> terms_{}; // six products of three factors, four terms each
  int size_ = 0;
};

int exactOrientation(const Eigen::Vector3d& u, const Eigen::Vector3d& v, const Eigen::Vector3d& w)
{
  ExactSum sum;
  sum.addProduct(u.x(), v.y(), w.z());
  sum.addProduct(-u.x(), v.z(), w.y());
  sum.addProduct(u.y(), v.z(), w.x());
  sum.addProduct(-u.y(), v.x(), w.z());
  sum.addProduct(u.z(), v.x(), w.y());
  sum.addProduct(-u.z(), v.y(), w.x());
  return sum.sign();
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
  ExactSum sum;
  sum.addProduct(u.x(), v.y());
  sum.addProduct(-u.y(), v.x());
  return sum.sign();
}

} // namespace pcl::mrf
