// SPDX-License-Identifier: BSD-3-Clause
/// Points that lie between two surfaces, on neither (mixed or flying pixels; the sensor's properties of Sec. 3.3.2;
/// ours).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/point_set.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Clears the flags of points next to which their sensor saw one surface in front of them and another behind, and
/// hardly anything as far away as they are: it measured a mixture of the two. See src/method.md, "Outliers". Does
/// nothing where it is not known who saw the points, and where a sensor has fewer of them than one in 4,000.
/// \return how many it cleared
///
/// Cost: of each sensor a search of its points and the 16 nearest of each, again while it finds more, and of 65,536 of
/// them where these have hardly any; some 45 bytes a point. \throw Cancelled
std::int64_t dropMixedPixels(const PointArrays& points, std::vector<std::uint8_t>& keep, Execution& execution);

} // namespace pcl::mrf
