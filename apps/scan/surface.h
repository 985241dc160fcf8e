/// \file
/// \brief What the simulator scans: a surface that can be sampled evenly and asked whether it blocks a line of sight.
#pragma once

#include <shapes/portable_math.h>

#include <Eigen/Core>

#include <cstdint>

namespace pcl {
namespace mrf {
namespace scan {

/// A box in double precision.
struct Box {
  Eigen::Vector3d lower = Eigen::Vector3d::Zero();
  Eigen::Vector3d upper = Eigen::Vector3d::Zero();
  Eigen::Vector3d centre() const { return .5 * (lower + upper); }
  double diagonal() const { return portable::norm(upper - lower); }
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

  virtual Box boundingBox() const = 0;
};

} // namespace scan
} // namespace mrf
} // namespace pcl
