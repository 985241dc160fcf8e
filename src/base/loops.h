// SPDX-License-Identifier: BSD-3-Clause
/// Loops over indices on all threads, and chances to cancel during long ones.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace pcl::mrf {

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
inline void forRangePolling(Execution& execution, std::int64_t count, std::int64_t grain,
                            const std::function<void(std::int64_t begin, std::int64_t end)>& body)
{
  const std::int64_t batch = execution.threads() * grain * std::max<std::int64_t>(parallelItemsPerPoll / grain, 1);
  for (std::int64_t first = 0; first < count; first += batch) {
    execution.forRange(std::min(batch, count - first), grain,
                       [&](std::int64_t begin, std::int64_t end) { body(first + begin, first + end); });
    execution.poll();
  }
}

/// The body of a range that calls body(i) for each of its indices.
template <typename Index, typename Body>
auto eachOf(const Body& body)
{
  return [&body](std::int64_t begin, std::int64_t end) {
    for (auto i = static_cast<Index>(begin); i < static_cast<Index>(end); ++i)
      body(i);
  };
}

/// Calls body(i) for 0 ≤ i < count, concurrently, in ranges of at most `grain` indices as Execution::forRange makes
/// them.
template <typename Index = std::size_t, typename Body>
void forEach(Execution& execution, std::int64_t count, std::int64_t grain, const Body& body)
{
  execution.forRange(count, grain, eachOf<Index>(body));
}

/// The same, polling. \throw Cancelled
template <typename Index = std::size_t, typename Body>
void forEachPolling(Execution& execution, std::int64_t count, std::int64_t grain, const Body& body)
{
  forRangePolling(execution, count, grain, eachOf<Index>(body));
}

/// Calls body(part, begin, end) for each range, which has a part of its own, polling. \return the parts, in the order
/// of the ranges \throw Cancelled
template <typename Part, typename Index = std::size_t, typename Body>
std::vector<Part> partsOf(Execution& execution, std::int64_t count, std::int64_t grain, const Body& body)
{
  std::vector<Part> parts((count + grain - 1) / grain);
  forRangePolling(execution, count, grain,
                  [&](Index begin, Index end) { body(parts[begin / static_cast<Index>(grain)], begin, end); });
  return parts;
}

/// All values of some lists, one list after the other, whose memory goes as the result's is filled.
template <typename Value>
std::vector<Value> joined(std::vector<std::vector<Value>> lists)
{
  std::size_t total = 0;
  for (const std::vector<Value>& list : lists)
    total += list.size();
  std::vector<Value> result;
  result.reserve(total);
  for (std::vector<Value>& list : lists) {
    result.insert(result.end(), list.begin(), list.end());
    std::vector<Value>().swap(list);
  }
  return result;
}

/// Sum of body(i), range by range, in an order that does not depend on the number of threads.
template <typename Index = std::size_t, typename Body>
double sumOver(Execution& execution, std::int64_t count, std::int64_t grain, const Body& body)
{
  return execution.sum(count, grain, [&](std::int64_t begin, std::int64_t end) {
    double total = 0;
    for (auto i = static_cast<Index>(begin); i < static_cast<Index>(end); ++i)
      total += body(i);
    return total;
  });
}

} // namespace pcl::mrf
