// SPDX-License-Identifier: BSD-3-Clause
/// Where no surface can be: in front of what a sensor saw.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/point_set.h>

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

struct Place {
  Eigen::Vector3f position;
  float margin; ///< what is behind it by less denies nothing, cloud's unit
};

/// Flags of the places that one of points.sensors saw a point through: the line of sight passes the place and then,
/// within two spacings of it, measured in its tangent plane, a point that faces the sensor. Of several sensors
/// points.views tell which one saw the point; without them, and of more than 256, nobody did.
/// \pre points.spacings is not empty
///
/// Cost: for each sensor n log n for its n points, and a query per place.
std::vector<std::uint8_t> seenThrough(const std::vector<Place>& places, const OrientedPoints& points,
                                      Execution& execution);

} // namespace pcl::mrf
