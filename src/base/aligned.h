// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Arrays that begin with a cache line.
#pragma once

#include <cstddef>
#include <new>

namespace pcl {
namespace mrf {

/// Memory whose first element begins a cache line, as vectors do that do not lie in two of them.
template <typename T>
struct AlignedAllocator {
  using value_type = T;
  static constexpr std::align_val_t alignment{64};

  AlignedAllocator() = default;
  template <typename U>
  AlignedAllocator(const AlignedAllocator<U>&)
  {}

  T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), alignment)); }
  void deallocate(T* at, std::size_t) { ::operator delete(at, alignment); }

  friend bool operator==(const AlignedAllocator&, const AlignedAllocator&) { return true; }
  friend bool operator!=(const AlignedAllocator&, const AlignedAllocator&) { return false; }
};

} // namespace mrf
} // namespace pcl
