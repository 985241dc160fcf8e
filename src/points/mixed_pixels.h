// SPDX-License-Identifier: BSD-3-Clause
/// Finds points between two surfaces, on neither (mixed or flying pixels; sensor's properties of Sec. 3.3.2; ours).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Clears the flags of mixed pixels, see src/method.md, "Outliers". Points of an unknown sensor stay, and so do all
/// points of a sensor if fewer than one in 4,000 are mixed.
/// \param search holds the points \return the number of flags cleared \throw Cancelled
///
/// Cost: for each sensor, a search structure of its points and the 16 nearest of each point, repeated while mixed
/// pixels are found. Of more than 131,072 points, a sample of 65,536 is searched first. Some 45 bytes per point.
std::int64_t dropMixedPixels(const PointArrays& points, const NeighborSearch& search, std::vector<std::uint8_t>& keep,
                             Execution& execution);

} // namespace pcl::mrf
