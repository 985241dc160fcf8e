// SPDX-License-Identifier: BSD-3-Clause
/// Large arrays: uninitialized, or zeroed and aligned.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <vector>

namespace pcl::mrf {

/// Leaves new elements uninitialized: one thread would clear a large array no faster than all threads fill it.
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

/// One value per voxel of a band, uninitialized.
using PackedValues = std::vector<float, UninitializedAllocator<float>>;
using PackedFlags = std::vector<std::uint8_t, UninitializedAllocator<std::uint8_t>>;

/// Frees memory of the heap, or of so many bytes of pages that were mapped.
struct FreeOrUnmap {
  std::size_t mapped = 0;

  void operator()(void* memory) const
  {
    if (mapped > 0)
      munmap(memory, mapped);
    else
      std::free(memory);
  }
};

/// Floats that are zero at first. Pages of a large array that are never written take neither memory nor time. Each
/// vector of 16 floats that begins at a multiple of 16 lies in a single cache line.
class ZeroedFloats {
public:
  ZeroedFloats() = default;

  /// \throw std::bad_alloc
  explicit ZeroedFloats(std::size_t size) : size_(size)
  {
    const std::size_t bytes = (size + line / sizeof(float)) * sizeof(float);
    if (bytes >= ownPages) {
      // calloc would clear, and so touch, all pages of a block that was in use before.
      void* const pages = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
      if (pages == MAP_FAILED)
        throw std::bad_alloc();
      memory_ = Memory(pages, FreeOrUnmap{bytes});
    } else {
      memory_.reset(std::calloc(bytes, 1));
      if (memory_ == nullptr)
        throw std::bad_alloc();
    }
    const auto address = reinterpret_cast<std::uintptr_t>(memory_.get());
    data_ = reinterpret_cast<float*>((address + line - 1) / line * line);
  }

  float* data() { return data_; }
  std::size_t size() const { return size_; }

private:
  static constexpr std::size_t line = 64, ownPages = 4 << 20; // bytes from which an array has pages of its own

  using Memory = std::unique_ptr<void, FreeOrUnmap>;
  Memory memory_;
  float* data_ = nullptr;
  std::size_t size_ = 0;
};

} // namespace pcl::mrf
