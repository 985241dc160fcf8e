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

/// What sensors tell of a place: nothing, that each had something in front of it, or that one saw a point through it.
enum class Sight { free, hidden, through };

/// What points.sensors tell of each place. A line of sight passes a point within two of its spacings, measured in its
/// tangent plane, before it comes to the place, or after. Of several sensors points.views tell which one saw the point
/// behind; without them, and of more than 256, nobody did. Without sensors all is free. \pre points.spacings is not
/// empty
///
/// Cost: for each sensor, as long as some place was hidden from all before it, n log n for the n points and a query per
/// place; for each of several that views tell of, the same with its own points.
std::vector<Sight> lookAt(const std::vector<Place>& places, const OrientedPoints& points, Execution& execution);

} // namespace mrf
} // namespace pcl
