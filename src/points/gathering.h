// SPDX-License-Identifier: BSD-3-Clause
/// From a raw cloud to the points that the stages can use.
#pragma once

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <cstdint>
#include <limits>
#include <string>

namespace pcl::mrf {

/// \throw ResourceLimit for more points than the indices of searches and of PCL count, 2³¹ − 1
inline void requireCountable(std::size_t points)
{
  constexpr std::size_t max = std::numeric_limits<std::int32_t>::max();
  if (points > max)
    throw ResourceLimit("the cloud has " + std::to_string(points) + " points, at most " + std::to_string(max) +
                        " can be numbered; thin it out, or reconstruct it in parts");
}

/// Builds the gathered points: the part of a cloud the stages can use.
/// \param cloud its arrays are freed one after the other, as soon as they have been read
/// \param counts receives input, notFinite, duplicates, zeroNormals, zeroConfidence
/// \throw InvalidInput as validate does, or if a sensor is not finite, or farther than 1e18 from the cloud
/// \throw InvalidOption if the options want normals that the cloud has not
/// Points with a normal that is zero or not finite are dropped only if the normals are to be used as they are. If all
/// normals are, they are left out instead, as of a cloud that has none yet. Of equal positions the first is kept.
/// \return the points along a space-filling curve, so that the stages find neighbors close in memory; neither their
/// positions nor their order depend on the order they came in
PointSet gather(RawCloud cloud, const Options& options, PointCounts& counts, Execution& execution);

} // namespace pcl::mrf
