// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What no sensor could see for the points in front of it.
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
  float margin; ///< what is in front of it by less does not hide it, cloud's unit
};

/// Flags of the places that are hidden from every one of points.sensors: the line of sight passes a point within two of
/// its spacings, measured in its tangent plane, before it comes to the place. Without sensors none is hidden.
/// \pre points.spacings is not empty
/// Cost: for each sensor, as long as some place is hidden from all before it, n log n for the n points and a query per
/// place.
std::vector<std::uint8_t> findHidden(const std::vector<Place>& places, const OrientedPoints& points,
                                     Execution& execution);

} // namespace mrf
} // namespace pcl
