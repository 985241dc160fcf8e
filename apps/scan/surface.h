// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What the simulator scans: a surface that can be sampled evenly and asked whether it blocks a line of sight.
#pragma once

#include <shapes/portable_math.h>

#include <Eigen/Core>

#include <algorithm>
#include <cstdint>
#include <limits>

namespace pcl {
namespace mrf {
namespace scan {

/// A box in double precision.
struct Box {
  Eigen::Vector3d lower = Eigen::Vector3d::Zero();
  Eigen::Vector3d upper = Eigen::Vector3d::Zero();
  Eigen::Vector3d center() const { return .5 * (lower + upper); }
  double diagonal() const { return portable::norm(upper - lower); }

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
  Eigen::Vector3d position;
  Eigen::Vector3d normal; ///< unit, out of the object
  std::int64_t part = 0;  ///< triangle or patch

  // How the normal changes along two perpendicular tangents, for displacing the surface along it.
  Eigen::Vector3d tangents[2] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  Eigen::Vector3d normalChanges[2] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  /// The direction that displacement takes: the normal, or on a mesh the interpolated one, which is continuous.
  Eigen::Vector3d displacementDirection = Eigen::Vector3d::Zero();
};

inline double Box::leaves(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const
{
  // A millionth of the diagonal: flat boxes have no thickness to be hit.
  const double margin = 1e-6 * diagonal();
  double enter = 0, leave = std::numeric_limits<double>::max();
  for (int axis = 0; axis < 3; ++axis) {
    const double below = lower[axis] - margin - origin[axis], above = upper[axis] + margin - origin[axis];
    if (direction[axis] == 0) {
      if (below > 0 || above < 0)
        return -1;
      continue;
    }
    const double a = below / direction[axis], b = above / direction[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave ? leave : -1;
}

class Surface {
public:
  virtual ~Surface() = default;

  /// Draws are spread over this area; those that sample() rejects do not lie on the surface.
  virtual double drawnArea() const = 0;

  /// The point of a draw; points are uniform per area over uniform draws.
  /// \return false if this draw is rejected
  virtual bool sample(const Draw& draw, SurfacePoint& point) const = 0;

  /// True if the surface lies between a point of it and a place outside that its normal faces.
  virtual bool isOccluded(const SurfacePoint& point, const Eigen::Vector3d& from) const = 0;

  /// The first place where a ray meets the surface, from whichever side; its tangents are not set.
  /// \param direction unit
  /// \return false if it meets none
  virtual bool firstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, SurfacePoint& point) const = 0;

  virtual Box boundingBox() const = 0;
};

} // namespace scan
} // namespace mrf
} // namespace pcl
