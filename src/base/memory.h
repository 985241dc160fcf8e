// SPDX-License-Identifier: BSD-3-Clause
/// What the process may still have and what it has taken.
#pragma once

#include <cstddef>

namespace pcl::mrf {

/// Bytes that this process can allocate without swapping: what the machine has (the physical memory where the system
/// does not tell), the limit of addresses leaves and the limits of control groups (version 1 and 2) leave, whichever is
/// least.
std::size_t availableMemory();

/// Peak resident bytes of this process so far.
std::size_t peakMemory();

/// Gives back to the system what has been freed and the allocator keeps.
void releaseFreedMemory();

/// Bytes that a run may take: the option, or 80 % of what is free if it is 0.
inline double memoryLimit(std::size_t maxMemory)
{
  return static_cast<double>(maxMemory > 0 ? maxMemory : availableMemory() / 10 * 8);
}

} // namespace pcl::mrf
