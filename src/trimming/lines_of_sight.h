// SPDX-License-Identifier: BSD-3-Clause
/// Finds where no surface can be: in front of what a sensor saw.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/point_set.h>

#include <Eigen/Core>

#include <cstdint>
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

} // namespace pcl::mrf
