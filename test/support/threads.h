// SPDX-License-Identifier: BSD-3-Clause
/// Checks that a result does not depend on the number of threads.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include <gtest/gtest.h>

/// For what is not about threads.
inline pcl::mrf::Execution serial(1);

/// Expects of(threads) to be the same for 1, 2 and 4 threads. \return the result
template <typename Of>
auto sameOnAnyThreads(const Of& of)
{
  const auto one = of(1);
  for (const int threads : {2, 4})
    EXPECT_TRUE(of(threads) == one) << threads << " threads";
  return one;
}
