// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Angles in full turns, and directions.
#pragma once

#include <Eigen/Geometry>

#include <cmath>

namespace shapes {

constexpr double pi = 3.14159265358979323846;

struct SinCos {
  double sine, cosine;
};

/// Of an angle in full turns.
inline SinCos sinCos(double turns)
{
  return {std::sin(2 * pi * turns), std::cos(2 * pi * turns)};
}

/// A unit vector perpendicular to the given unit vector.
inline Eigen::Vector3d perpendicular(const Eigen::Vector3d& a)
{
  // The axis that is farthest from a, so that the cross product is well away from zero.
  const Eigen::Vector3d axis = std::abs(a.x()) < .6 ? Eigen::Vector3d(1, 0, 0) : Eigen::Vector3d(0, 1, 0);
  return a.cross(axis).normalized();
}

} // namespace shapes
