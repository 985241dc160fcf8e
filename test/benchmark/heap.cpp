#include "heap.h"

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<std::int64_t> held{0}, peak{0};

void* counted(void* memory)
{
  if (memory == nullptr)
    throw std::bad_alloc();
  const std::int64_t now = held += static_cast<std::int64_t>(malloc_usable_size(memory));
  std::int64_t known = peak;
  while (known < now && !peak.compare_exchange_weak(known, now)) {
  }
  return memory;
}

void release(void* memory)
{
  held -= static_cast<std::int64_t>(malloc_usable_size(memory));
  std::free(memory);
}

} // namespace

namespace benchmarks {

std::int64_t heapBytes()
{
  return held;
}

std::int64_t peakBytes()
{
  return peak;
}

void resetPeak()
{
  peak = held.load();
}

} // namespace benchmarks

// The other forms of new and delete call these.
void* operator new(std::size_t size)
{
  return counted(std::malloc(std::max<std::size_t>(size, 1)));
}

void* operator new(std::size_t size, std::align_val_t alignment)
{
  const auto side = static_cast<std::size_t>(alignment);
  return counted(std::aligned_alloc(side, (std::max<std::size_t>(size, 1) + side - 1) / side * side));
}

void operator delete(void* memory) noexcept
{
  release(memory);
}

void operator delete(void* memory, std::size_t) noexcept
{
  release(memory);
}

void operator delete(void* memory, std::align_val_t) noexcept
{
  release(memory);
}

void operator delete(void* memory, std::size_t, std::align_val_t) noexcept
{
  release(memory);
}
