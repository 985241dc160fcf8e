// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Large arrays that are not set when they are made.
#pragma once

#include <memory>
#include <new>

namespace pcl {
namespace mrf {

/// Leaves new elements uninitialized: clearing a large array first would cost one thread as much as filling it costs
/// all of them.
template <typename T>
struct UninitializedAllocator : std::allocator<T> {
  template <typename U>
  struct rebind {
    using other = UninitializedAllocator<U>;
  };

  template <typename U>
  void construct(U* at)
  {
    ::new (static_cast<void*>(at)) U;
  }
};

} // namespace mrf
} // namespace pcl
