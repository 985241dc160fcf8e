// SPDX-License-Identifier: BSD-3-Clause
#include "base/loops.h"

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

TEST(Loops, EachIndexHasItsTurnAndEachRangeAPart)
{
  constexpr std::int64_t count = 10007, grain = 1000;
  for (const int threads : {1, 3}) {
    Execution execution(threads);
    std::vector<int> turns(count, 0);
    forEach(execution, count, grain, [&](std::size_t i) { ++turns[i]; });
    forEachPolling<std::int32_t>(execution, count, grain, [&](std::int32_t i) { ++turns[i]; });
    EXPECT_EQ(turns, std::vector<int>(count, 2));
    EXPECT_EQ(sumOver(execution, count, grain, [](std::size_t i) { return static_cast<double>(i); }),
              count * (count - 1) / 2);
    const auto parts = partsOf<std::vector<std::size_t>>(
        execution, count, grain, [](std::vector<std::size_t>& part, std::size_t begin, std::size_t end) {
          part = {begin, end};
        });
    ASSERT_EQ(parts.size(), 11u);
    const std::vector<std::size_t> bounds = joined(parts);
    for (std::size_t n = 0; n < parts.size(); ++n) {
      EXPECT_EQ(bounds[2 * n], n * grain);
      EXPECT_EQ(bounds[2 * n + 1], std::min<std::size_t>((n + 1) * grain, count));
    }
  }
}
