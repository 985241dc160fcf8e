// SPDX-License-Identifier: BSD-3-Clause
/// Counts the progress calls of a run, and checks that the run stops when it is cancelled.
#pragma once

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/execution.h>

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

/// The number of calls of the callback during run(execution).
template <typename Run>
std::int64_t callsDuring(const Run& run, int threads = 1)
{
  std::int64_t calls = 0;
  pcl::mrf::Execution execution(threads, [&](const std::string&, double) {
    ++calls;
    return true;
  });
  run(execution);
  return calls;
}

/// Cancels run(execution) at the first call, at the last one, and at two between.
template <typename Run>
void expectCancelledWhereverItAsks(const Run& run)
{
  constexpr int threads = 2;
  const std::int64_t total = callsDuring(run, threads);
  ASSERT_GT(total, 0);
  for (const std::int64_t last : {std::int64_t{1}, (total + 2) / 3, (2 * total + 2) / 3, total}) {
    std::int64_t calls = 0;
    pcl::mrf::Execution execution(threads, [&](const std::string&, double) { return ++calls < last; });
    EXPECT_THROW(run(execution), pcl::mrf::Cancelled) << "at call " << last << " of " << total;
    EXPECT_EQ(calls, last);
  }
}
