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

/// \throw ResourceLimit if there are more than 2³¹ − 1 points, the limit of the indices of searches and of PCL
inline void requireCountable(std::size_t points)
{
  constexpr std::size_t max = std::numeric_limits<std::int32_t>::max();
  if (points > max)
    throw ResourceLimit("the cloud has " + std::to_string(points) + " points, at most " + std::to_string(max) +
                        " can be numbered; thin it out, or reconstruct it in parts");
}

/// Builds the gathered points: the part of a cloud the stages can use.
/// Points whose normal is zero or not finite are dropped only for NormalSource::use. If all normals are zero or not
/// finite, the normals are removed instead, as if the cloud had none. Of equal positions only the first is kept.
/// \param cloud its arrays are freed one after the other, as soon as they have been read
/// \param counts receives input, used, notFinite, duplicates, zeroNormals, zeroConfidence
/// \throw InvalidInput as validate does, or if a sensor is not finite, or farther than 1e18 from the cloud
/// \throw InvalidOption if the options need normals and the cloud has none, or if the noise is given twice
/// \return the points sorted along a space-filling curve, so that neighbors are close in memory. Positions and order
/// do not depend on the order of the input
PointSet gather(RawCloud cloud, const Options& options, PointCounts& counts, Execution& execution);

} // namespace pcl::mrf
