// SPDX-License-Identifier: BSD-3-Clause
#include "base/polling.h"

#include "support/cancelling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>
#include <utility>
#include <vector>

using namespace pcl::mrf;

namespace {

using Range = std::pair<std::int64_t, std::int64_t>;

/// The ranges that a loop is cut into, ascending.
template <typename Loop>
std::vector<Range> rangesOf(const Loop& loop)
{
  std::mutex mutex;
  std::vector<Range> ranges;
  loop([&](std::int64_t begin, std::int64_t end) {
    const std::lock_guard<std::mutex> lock(mutex);
    ranges.emplace_back(begin, end);
  });
  std::sort(ranges.begin(), ranges.end());
  return ranges;
}

} // namespace

TEST(Polling, TheRangesAreThoseOfOneLoop)
{
  // The last: a grain of more items than there may be between two calls.
  for (const std::int64_t grain : {std::int64_t{1000}, std::int64_t{32768}, 2 * parallelItemsPerPoll})
    for (const std::int64_t count : {std::int64_t{0}, std::int64_t{1}, grain, 5 * parallelItemsPerPoll + 7})
      for (const int threads : {1, 3}) {
        Execution execution(threads);
        const auto whole = rangesOf([&](const auto& body) { execution.forRange(count, grain, body); });
        const auto cut = rangesOf([&](const auto& body) { forRangePolling(execution, count, grain, body); });
        EXPECT_EQ(cut, whole) << count << " by " << grain << " on " << threads;
      }
}

TEST(Polling, ParallelLoopsAskByTheWorkOfAThread)
{
  const auto loop = [](Execution& execution) {
    forRangePolling(execution, 12 * parallelItemsPerPoll, 4096, [](std::int64_t, std::int64_t) {});
  };
  EXPECT_EQ(callsDuring(loop, 1), 12);
  EXPECT_EQ(callsDuring(loop, 3), 4);
  expectCancelledWhereverItAsks(loop);
}

TEST(Polling, SerialLoopsAskByTheirItems)
{
  const auto loop = [](Execution& execution) {
    Poller poll(execution);
    for (std::int64_t i = 0; i < 10 * serialItemsPerPoll + 1; ++i)
      poll();
  };
  EXPECT_EQ(callsDuring(loop), 10);
  expectCancelledWhereverItAsks(loop);
}
