// SPDX-License-Identifier: BSD-3-Clause
/// How many points the indices can count.
#pragma once

#include <pcl/surface/mrf/exceptions.h>

#include <cstddef>
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

} // namespace pcl::mrf
