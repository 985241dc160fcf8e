/// \file
/// \brief Connected components of points, found by all threads at once.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace pcl {
namespace mrf {

/// Disjoint sets that may be joined concurrently. A set's root is its smallest element, so the result does not depend
/// on the order of the joins.
class DisjointPoints {
public:
  explicit DisjointPoints(std::size_t count) : parents_(count)
  {
    for (std::size_t i = 0; i < count; ++i)
      parents_[i].store(static_cast<std::uint32_t>(i), std::memory_order_relaxed);
  }

  /// The smallest element of i's set. While sets are joined it may be outdated when it is returned.
  std::uint32_t find(std::uint32_t i)
  {
    for (;;) {
      std::uint32_t parent = parents_[i].load(std::memory_order_relaxed);
      if (parent == i)
        return i;
      const std::uint32_t next = parents_[parent].load(std::memory_order_relaxed);
      // Halves the path. Losing a race does no harm: some other thread has shortened it.
      if (next != parent)
        parents_[i].compare_exchange_weak(parent, next, std::memory_order_relaxed);
      i = next;
    }
  }

  void join(std::uint32_t i, std::uint32_t j)
  {
    for (;;) {
      i = find(i);
      j = find(j);
      if (i == j)
        return;
      if (i < j)
        std::swap(i, j);
      std::uint32_t expected = i;
      if (parents_[i].compare_exchange_strong(expected, j, std::memory_order_relaxed))
        return;
    }
  }

  /// The number of elements of each set, at its smallest one; 0 elsewhere.
  std::vector<std::uint32_t> sizes()
  {
    std::vector<std::uint32_t> result(parents_.size(), 0);
    for (std::size_t i = 0; i < parents_.size(); ++i)
      ++result[find(static_cast<std::uint32_t>(i))];
    return result;
  }

private:
  std::vector<std::atomic<std::uint32_t>> parents_;
};

} // namespace mrf
} // namespace pcl
