// SPDX-License-Identifier: BSD-3-Clause
/// Works on several regions of a mesh at a time.
#pragma once

#include "base/loops.h"

#include <pcl/surface/mrf/execution.h>

#include <algorithm>
#include <cstdint>
#include <thread>
#include <vector>

namespace pcl::mrf {

enum class Turn { now, later, never };

/// Calls work(item, own) for the items 0 to count - 1: first for each region's items in order, several regions at a
/// time, then for the items that reach into other regions. The result is the same for any number of threads.
/// \param regionOf region of an item
/// \param turnOf(item, region) when to work on an item, asked when the region's items before it are done
/// \return the `own` objects that work() got: one per region, then one for the items that had to wait
/// \throw Cancelled
template <typename Own, typename RegionOf, typename TurnOf, typename Work>
std::vector<Own> workByRegion(std::int32_t count, const RegionOf& regionOf, const TurnOf& turnOf, const Work& work,
                              Execution& execution)
{
  std::vector<std::vector<std::int32_t>> listed; // items of each region
  for (std::int32_t n = 0; n < count; ++n) {
    const std::size_t region = regionOf(n);
    listed.resize(std::max(listed.size(), region + 1));
    listed[region].push_back(n);
  }
  std::vector<Own> owns(listed.size() + 1);
  std::vector<std::uint8_t> isWaiting(count, 0);
  Poller poll(execution);
  const std::thread::id caller = std::this_thread::get_id();
  forEach(execution, static_cast<std::int64_t>(listed.size()), 1, [&](std::size_t region) {
    const bool mayPoll = std::this_thread::get_id() == caller;
    for (const std::int32_t n : listed[region]) {
      if (mayPoll)
        poll();
      const Turn turn = turnOf(n, static_cast<std::uint16_t>(region));
      isWaiting[n] = turn == Turn::later;
      if (turn == Turn::now)
        work(n, owns[region]);
    }
  });
  for (std::int32_t n = 0; n < count; ++n) {
    poll();
    if (isWaiting[n])
      work(n, owns.back());
  }
  return owns;
}

} // namespace pcl::mrf
