// SPDX-License-Identifier: BSD-3-Clause
/// Large arrays that are not set when they are made, or zero and aligned.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <vector>

namespace pcl::mrf {

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

/// One value per voxel of a band, not set when they are made.
using PackedValues = std::vector<float, UninitializedAllocator<float>>;
using PackedFlags = std::vector<std::uint8_t, UninitializedAllocator<std::uint8_t>>;

/// Floats that are zero at first. Whole pages of a large array that nobody writes to take neither memory nor time, and
/// vectors of 16 that begin at a multiple of 16 do not lie in two cache lines.
class ZeroedFloats {
public:
  ZeroedFloats() = default;

  /// \throw std::bad_alloc
  explicit ZeroedFloats(std::size_t size)
      : memory_(std::calloc(size + line / sizeof(float), sizeof(float))), size_(size)
  {
    if (memory_ == nullptr)
      throw std::bad_alloc();
    const auto address = reinterpret_cast<std::uintptr_t>(memory_.get());
    data_ = reinterpret_cast<float*>((address + line - 1) / line * line);
  }

  float* data() { return data_; }
  std::size_t size() const { return size_; }

private:
  static constexpr std::size_t line = 64;

  struct Free {
    void operator()(void* memory) const { std::free(memory); }
  };
  std::unique_ptr<void, Free> memory_;
  float* data_ = nullptr;
  std::size_t size_ = 0;
};

} // namespace pcl::mrf
