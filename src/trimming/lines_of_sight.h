// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Where no surface can be: behind what sensors saw, and in front of it.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/point_set.h>

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

struct Place {
  Eigen::Vector3f position;
  float margin; ///< what is in front of it, or behind it, by less denies nothing, cloud's unit
};

/// Flags of the places where no surface can be for what the sensors saw: each of points.sensors had something in front
/// of it, or the only one saw through it. The line of sight then passes a point within two of its spacings, measured in
/// its tangent plane, before it comes to the place, or after. Of several sensors it is not known which one saw the
/// point behind. Without sensors no place is denied. \pre points.spacings is not empty Cost: for each sensor, as long
/// as some place is denied by all before it, n log n for the n points and a query per place.
std::vector<std::uint8_t> findDenied(const std::vector<Place>& places, const OrientedPoints& points,
                                     Execution& execution);

} // namespace mrf
} // namespace pcl
