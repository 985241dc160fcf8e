// SPDX-License-Identifier: BSD-3-Clause
/// Signed distances to analytic shapes, to scan them and to measure errors against them.
#pragma once

#include <Eigen/Geometry>

#include <cmath>
#include <functional>
#include <vector>

namespace shapes {

/// Signed distance, negative inside. The zero level is exact for every shape here; the distance itself is, unless said
/// otherwise.
using Sdf = std::function<double(const Eigen::Vector3d&)>;

Sdf sphere(double radius, const Eigen::Vector3d& center = Eigen::Vector3d::Zero());
/// Torus around the z axis.
Sdf torus(double majorRadius, double minorRadius);
/// Axis-aligned box with its edges rounded by `rounding`; `half` are the outer half sides.
Sdf box(const Eigen::Vector3d& half, double rounding = 0);
/// Capsule between two points.
Sdf tube(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius);
/// Solid cylinder with flat ends at two points.
Sdf cylinder(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius);
/// Half space below the plane through the origin with the given outward normal.
Sdf plane(const Eigen::Vector3d& normal);

/// The shape moved by `offset`.
Sdf translate(const Sdf& shape, const Eigen::Vector3d& offset);
/// The union; exact outside. Inside, where shapes overlap, the absolute value is a lower bound of the distance.
Sdf unite(const Sdf& a, const Sdf& b);
Sdf unite(std::vector<Sdf> shapes);
/// The part of a outside of all of b; outside of it the value is a lower bound of the distance.
Sdf subtract(const Sdf& a, std::vector<Sdf> b);

/// Unit outward normal by central differences.
Eigen::Vector3d normalOf(const Sdf& sdf, const Eigen::Vector3d& position, double step = 1e-5);

constexpr double pi = 3.14159265358979323846;

struct SinCos {
  double sine, cosine;
};

/// Sine and cosine of an angle in full turns.
inline SinCos sinCos(double turns)
{
  return {std::sin(2 * pi * turns), std::cos(2 * pi * turns)};
}

/// A unit vector perpendicular to the given unit vector.
inline Eigen::Vector3d perpendicular(const Eigen::Vector3d& a)
{
  // An axis that is not close to a, so that the cross product is well away from zero.
  const Eigen::Vector3d axis = std::abs(a.x()) < .6 ? Eigen::Vector3d(1, 0, 0) : Eigen::Vector3d(0, 1, 0);
  return a.cross(axis).normalized();
}

} // namespace shapes
