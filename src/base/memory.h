// SPDX-License-Identifier: BSD-3-Clause
/// The memory that the process may still allocate, and its peak.
#pragma once

#include <cstddef>

namespace pcl::mrf {

/// Bytes that this process can allocate without swapping: the minimum of the machine's available memory (its physical
/// memory if the system does not tell), the rest of the limit of addresses, and the rest of the limits of control
/// groups (versions 1 and 2).
std::size_t availableMemory();

/// Peak resident bytes of this process so far.
std::size_t peakMemory();

/// Gives memory that was freed, but that the allocator keeps, back to the system.
void releaseFreedMemory();

/// Bytes that a run may take: the option, or 80 % of the available memory if it is 0.
inline double memoryLimit(std::size_t maxMemory)
{
  return static_cast<double>(maxMemory > 0 ? maxMemory : availableMemory() / 10 * 8);
}

} // namespace pcl::mrf
