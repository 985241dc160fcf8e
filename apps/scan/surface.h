// SPDX-License-Identifier: BSD-3-Clause
/// A surface to scan: it can be sampled, and rays hit it.
#pragma once

#include <shapes/signed_distance.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace pcl::mrf::scan {

using shapes::perpendicular;
using shapes::pi;
using shapes::SinCos;
using shapes::sinCos;

// Rotations about x, then y, then z, in degrees.

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

using Box = Eigen::AlignedBox3d;

/// 1 / direction, with a huge number instead of infinity: 0 · ∞ would be NaN for a ray in the plane of a box's face.
inline Eigen::Vector3d inverseOf(const Eigen::Vector3d& direction)
{
  return direction.unaryExpr([](double d) { return std::abs(d) > 1e-300 ? 1 / d : 1e300; });
}

/// Cuts the part of a ray from `enter` to `leave`, in lengths of its direction, to what is inside a box.
inline void clip(const Box& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& inverse, double& enter,
                 double& leave)
{
  const Eigen::Vector3d a = (box.min() - origin).cwiseProduct(inverse), b = (box.max() - origin).cwiseProduct(inverse);
  enter = std::max(enter, a.cwiseMin(b).maxCoeff());
  leave = std::min(leave, a.cwiseMax(b).minCoeff());
}

/// The distance at which a ray leaves a box, in lengths of its direction; negative if the ray misses the box.
double leaves(const Box& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

/// The random numbers that give one candidate, each in [0, 1).
struct Draw {
  double part = 0;         ///< selects the triangle or patch
  double u = 0, v = 0;     ///< select the place on it
  double accept = 0;       ///< decides about rejection, in patches whose parameters are not proportional to area
  std::uint64_t order = 0; ///< gives the order in which views are tried
};

struct SurfacePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ(); ///< unit, out of the object
  std::int64_t part = 0;                             ///< triangle or patch
};

struct Triangles {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::int32_t, 3>> triangles; ///< counter-clockwise seen from outside
};

class Surface {
public:
  virtual ~Surface() = default;

  /// The whole surface, seen or not.
  virtual Triangles triangulate() const = 0;

  /// The area over which draws are spread; the draws that sample() rejects are not on the surface.
  virtual double drawnArea() const = 0;

  /// The point of a draw; uniform draws give points of uniform density.
  /// \return false if this draw is rejected
  virtual bool sample(const Draw& draw, SurfacePoint& point) const = 0;

  /// True if the surface hides one of its points from a place outside that the point's normal faces.
  virtual bool isOccluded(const SurfacePoint& point, const Eigen::Vector3d& from) const = 0;

  /// The first place where a ray meets the surface, from whichever side.
  /// \param direction unit
  /// \return false if it meets none
  virtual bool firstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, SurfacePoint& point) const = 0;

  virtual Box boundingBox() const = 0;
};

} // namespace pcl::mrf::scan
