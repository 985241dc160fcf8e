// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What a sensor looks at: a surface that can be sampled, and that rays hit.
#pragma once

#include <shapes/turns.h>

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace pcl::mrf::scan {

using shapes::perpendicular;
using shapes::pi;
using shapes::SinCos;
using shapes::sinCos;

/// A box in double precision.
struct Box {
  Eigen::Vector3d lower = Eigen::Vector3d::Zero();
  Eigen::Vector3d upper = Eigen::Vector3d::Zero();
  Eigen::Vector3d center() const { return .5 * (lower + upper); }
  double diagonal() const { return (upper - lower).norm(); }

  /// Where a ray leaves the box, in lengths of its direction; negative if it misses it.
  double leaves(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
};

/// The random numbers that one candidate is made of, each in [0, 1).
struct Draw {
  double part = 0;         ///< which triangle or patch
  double u = 0, v = 0;     ///< where on it
  double accept = 0;       ///< for patches whose parameters are not proportional to area
  std::uint64_t order = 0; ///< in which order views are tried
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

  /// The surface itself, seen or not.
  virtual Triangles triangulate() const = 0;

  /// Draws are spread over this area; those that sample() rejects do not lie on the surface.
  virtual double drawnArea() const = 0;

  /// The point of a draw; points are uniform per area over uniform draws.
  /// \return false if this draw is rejected
  virtual bool sample(const Draw& draw, SurfacePoint& point) const = 0;

  /// True if the surface lies between a point of it and a place outside that its normal faces.
  virtual bool isOccluded(const SurfacePoint& point, const Eigen::Vector3d& from) const = 0;

  /// The first place where a ray meets the surface, from whichever side.
  /// \param direction unit
  /// \return false if it meets none
  virtual bool firstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, SurfacePoint& point) const = 0;

  virtual Box boundingBox() const = 0;
};

} // namespace pcl::mrf::scan
