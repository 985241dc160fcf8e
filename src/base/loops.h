// SPDX-License-Identifier: BSD-3-Clause
/// Loops over indices on all threads, which poll for cancellation.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace pcl::mrf {

/// Items between two polls of a loop on one thread, for items of some microseconds.
constexpr std::int64_t serialItemsPerPoll = 4096;
/// Items per thread between two polls of a parallel loop: some tenths of a second, so that threads rarely wait.
constexpr std::int64_t parallelItemsPerPoll = 131072;

/// Polls every serialItemsPerPoll items. Call it for each item of a serial loop.
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

/// Execution::forRange with the same ranges, in batches; polls after each batch.
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

/// A body for ranges that calls body(i) for each index. \pre `body` outlives the result
template <typename Index, typename Body>
auto eachOf(const Body& body)
{
  return [&body](std::int64_t begin, std::int64_t end) {
    for (auto i = static_cast<Index>(begin); i < static_cast<Index>(end); ++i)
      body(i);
  };
}

/// Calls body(i) for 0 ≤ i < count concurrently, in the ranges of Execution::forRange.
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

/// Calls body(part, begin, end) for each range, with a part of its own for each range; polls.
/// \return the parts, in the order of the ranges \throw Cancelled
template <typename Part, typename Index = std::size_t, typename Body>
std::vector<Part> partsOf(Execution& execution, std::int64_t count, std::int64_t grain, const Body& body)
{
  std::vector<Part> parts((count + grain - 1) / grain);
  forRangePolling(execution, count, grain,
                  [&](Index begin, Index end) { body(parts[begin / static_cast<Index>(grain)], begin, end); });
  return parts;
}

/// Concatenates lists; frees the memory of each list after it is copied.
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
