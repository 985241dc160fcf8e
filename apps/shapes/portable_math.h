// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Arithmetic that gives the same bits on every IEEE machine.
///
/// The mathematical functions of the C library and the order of Eigen's vectorized sums differ between platforms;
/// these are made of additions, multiplications, divisions and square roots in a fixed order.
#pragma once

#include <Eigen/Core>

#include <cmath>

namespace portable {

inline double dot(const Eigen::Vector3d& a, const Eigen::Vector3d& b)
{
  return a.x() * b.x() + a.y() * b.y() + a.z() * b.z();
}

inline Eigen::Vector3d cross(const Eigen::Vector3d& a, const Eigen::Vector3d& b)
{
  return {a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(), a.x() * b.y() - a.y() * b.x()};
}

inline double norm(const Eigen::Vector3d& a)
{
  return std::sqrt(dot(a, a));
}

/// The vector divided by its length; the zero vector stays as it is.
inline Eigen::Vector3d unit(const Eigen::Vector3d& a)
{
  const double length = norm(a);
  return length > 0 ? Eigen::Vector3d(a / length) : a;
}

/// A unit vector perpendicular to the given unit vector.
inline Eigen::Vector3d perpendicular(const Eigen::Vector3d& a)
{
  // The axis that is farthest from a, so that the cross product is well away from zero.
  const Eigen::Vector3d axis = std::abs(a.x()) < .6 ? Eigen::Vector3d(1, 0, 0) : Eigen::Vector3d(0, 1, 0);
  return unit(cross(a, axis));
}

struct SinCos {
  double sine, cosine;
};

/// Sine and cosine of an angle in full turns; error below 1e-15.
SinCos sinCos(double turns);

/// Natural logarithm of a positive number; relative error below 1e-15 away from 1.
double logarithm(double x);

} // namespace portable
