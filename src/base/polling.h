// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Chances to cancel during the long loops of a stage.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include <algorithm>
#include <cstdint>

namespace pcl {
namespace mrf {

/// Of a loop on one thread, whose items take some microseconds each.
constexpr std::int64_t serialItemsPerPoll = 4096;
/// Of a parallel loop, by each thread: some tenths of a second, so that few threads wait for others in between.
constexpr std::int64_t parallelItemsPerPoll = 131072;

/// Called for each item of a serial loop, polls every now and then.
class Poller {
public:
  explicit Poller(Execution& execution) : execution_(execution) {}

  /// \throw Cancelled
  void operator()()
  {
    if (++items_ % serialItemsPerPoll == 0)
      execution_.poll();
  }

private:
  Execution& execution_;
  std::int64_t items_ = 0;
};

/// Execution::forRange, with the same ranges, in batches after each of which it polls.
/// \throw Cancelled
template <typename Body>
void forRangePolling(Execution& execution, std::int64_t count, std::int64_t grain, const Body& body)
{
  const std::int64_t batch = execution.threads() * grain * std::max<std::int64_t>(parallelItemsPerPoll / grain, 1);
  for (std::int64_t first = 0; first < count; first += batch) {
    execution.forRange(std::min(batch, count - first), grain,
                       [&](std::int64_t begin, std::int64_t end) { body(first + begin, first + end); });
    execution.poll();
  }
}

} // namespace mrf
} // namespace pcl
