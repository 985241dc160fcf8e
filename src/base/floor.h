// SPDX-License-Identifier: BSD-3-Clause
/// The floor of a coordinate without a call.
#pragma once

namespace pcl::mrf {

/// ⌊coordinate⌋; std::floor is a call on the baseline processor. \pre it fits an int
inline int floorOf(float coordinate)
{
  const auto truncated = static_cast<int>(coordinate);
  return truncated - (coordinate < static_cast<float>(truncated) ? 1 : 0);
}

} // namespace pcl::mrf
