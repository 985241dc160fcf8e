// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Wall-clock time.
#pragma once

#include <chrono>

namespace pcl::mrf {

using Clock = std::chrono::steady_clock;

inline double secondsSince(Clock::time_point start)
{
  return std::chrono::duration<double>(Clock::now() - start).count();
}

} // namespace pcl::mrf
