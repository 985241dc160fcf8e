/// \file
/// \brief What the machine has left and what the process has taken.
#pragma once

#include <cstddef>

namespace pcl {
namespace mrf {

/// Bytes that can be allocated without swapping; the physical memory where the system does not tell.
std::size_t availableMemory();

/// Peak resident bytes of this process so far.
std::size_t peakMemory();

} // namespace mrf
} // namespace pcl
