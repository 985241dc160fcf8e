// SPDX-License-Identifier: BSD-3-Clause
/// Finds where no surface can be: in front of what a sensor saw.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/point_set.h>

#include <Eigen/Core>

#include <cstdint>
#include <functional>
#include <vector>

namespace pcl::mrf {

struct Place {
  Eigen::Vector3f position;
  float margin; ///< points that are behind it by less do not count, cloud's unit
};

/// Flags of the places through which one of points.sensors saw a point that faces it: behind the place, the line of
/// sight meets the point's tangent plane within two spacings of the point. With several sensors points.views tell which
/// one saw a point; without views, and with more than 256 sensors, no place is flagged.
/// \pre points.spacings is not empty
///
/// Cost: for each sensor n log n for its n points, and a query per place.
std::vector<std::uint8_t> seenThrough(const std::vector<Place>& places, const OrientedPoints& points,
                                      Execution& execution);

/// The surfaces that points stand for.
struct Surfaces {
  std::function<std::int32_t(std::uint32_t point)> numberOf; ///< -1: none
  const std::vector<double>& areas;                          ///< by numbers

  bool isLarger(std::uint32_t point, std::int32_t than) const
  {
    const std::int32_t own = numberOf(point);
    return own >= 0 && own != than && areas[own] > areas[than];
  }
};

/// Flags of the points whose surface and a larger one contradict each other: a sensor saw the larger one through the
/// point's, or the point through the larger one. What is behind is so by clearance(); which sensors count is as in
/// seenThrough.
/// \param asked points of the cloud \pre points.spacings is not empty
///
/// Cost: for each sensor n log n for its n points, and up to two queries per asked point.
std::vector<std::uint8_t> contradicted(const std::vector<std::uint32_t>& asked, const Surfaces& surfaces,
                                       const OrientedPoints& points, Execution& execution);

} // namespace pcl::mrf
