/// \file
/// \brief Arrays of one value per voxel of a band, not set when they are made.
#pragma once

#include <cstdint>
#include <memory>
#include <new>
#include <vector>

namespace pcl {
namespace mrf {

/// Leaves new elements uninitialised: clearing a large array first would cost one thread as much as filling it costs
/// all of them.
template <typename T>
struct UninitialisedAllocator : std::allocator<T> {
  template <typename U>
  struct rebind {
    using other = UninitialisedAllocator<U>;
  };

  template <typename U>
  void construct(U* at)
  {
    ::new (static_cast<void*>(at)) U;
  }
};

using PackedValues = std::vector<float, UninitialisedAllocator<float>>;
using PackedFlags = std::vector<std::uint8_t, UninitialisedAllocator<std::uint8_t>>;

} // namespace mrf
} // namespace pcl
