// SPDX-License-Identifier: BSD-3-Clause
#include "heap.h"

#include <malloc.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>

namespace {

std::atomic<std::int64_t> held{0}, peak{0};

void* counted(void* memory)
{
  if (memory == nullptr)
    return memory;
  const std::int64_t now = held += static_cast<std::int64_t>(malloc_usable_size(memory));
  std::int64_t known = peak;
  while (known < now && !peak.compare_exchange_weak(known, now)) {
  }
  return memory;
}

void discount(void* memory)
{
  if (memory != nullptr)
    held -= static_cast<std::int64_t>(malloc_usable_size(memory));
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

// The functions of glibc. All allocations go through one of these: operator new, Eigen, C libraries. Sanitizers need
// them for themselves.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* memory);

void* malloc(std::size_t size)
{
  return counted(__libc_malloc(size));
}

void* calloc(std::size_t count, std::size_t size)
{
  return counted(__libc_calloc(count, size));
}

void* realloc(void* memory, std::size_t size)
{
  discount(memory);
  void* const result = __libc_realloc(memory, size);
  return counted(result != nullptr || size == 0 ? result : memory) == result ? result : nullptr;
}

void* memalign(std::size_t alignment, std::size_t size)
{
  return counted(__libc_memalign(alignment, size));
}

void* aligned_alloc(std::size_t alignment, std::size_t size)
{
  return memalign(alignment, size);
}

int posix_memalign(void** result, std::size_t alignment, std::size_t size)
{
  *result = memalign(alignment, size);
  return *result != nullptr ? 0 : ENOMEM;
}

void free(void* memory)
{
  discount(memory);
  __libc_free(memory);
}
}
#endif
