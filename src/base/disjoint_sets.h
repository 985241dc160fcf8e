// SPDX-License-Identifier: BSD-3-Clause
/// Connected components, which several threads can join at once.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace pcl::mrf {

/// Disjoint sets that may be joined concurrently. A set's root is its smallest element, so the result does not depend
/// on the order of the joins.
class DisjointSets {
public:
  explicit DisjointSets(std::size_t count) : parents_(count)
  {
    for (std::size_t i = 0; i < count; ++i)
      parents_[i].store(static_cast<std::uint32_t>(i), std::memory_order_relaxed);
  }

  /// The smallest element of i's set. While sets are joined concurrently, the result may already be outdated.
  std::uint32_t find(std::uint32_t i)
  {
    for (;;) {
      std::uint32_t parent = parents_[i].load(std::memory_order_relaxed);
      if (parent == i)
        return i;
      const std::uint32_t next = parents_[parent].load(std::memory_order_relaxed);
      // Halves the path. A lost race does no harm: then another thread has shortened it.
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
  std::vector<std::atomic<std::uint32_t>> sizes(Execution& execution)
  {
    std::vector<std::atomic<std::uint32_t>> result(parents_.size());
    constexpr std::int64_t grain = 1 << 14;
    execution.forRange(parents_.size(), grain, [&](std::uint32_t begin, std::uint32_t end) {
      // Consecutive elements are often in the same set, so few additions collide.
      std::uint32_t root = find(begin), number = 0;
      for (std::uint32_t i = begin; i < end; ++i) {
        const std::uint32_t own = find(i);
        if (own != root)
          result[root].fetch_add(std::exchange(number, 0), std::memory_order_relaxed);
        root = own;
        ++number;
      }
      result[root].fetch_add(number, std::memory_order_relaxed);
    });
    return result;
  }

  /// The smallest element of the largest set. \pre there are elements
  std::uint32_t largest(Execution& execution)
  {
    const std::vector<std::atomic<std::uint32_t>> all = sizes(execution);
    return static_cast<std::uint32_t>(std::max_element(all.begin(), all.end()) - all.begin());
  }

private:
  std::vector<std::atomic<std::uint32_t>> parents_;
};

/// A partition of elements: the number of each element's set, in the order of the sets' smallest elements.
struct Partition {
  std::vector<std::uint32_t> set;
  std::vector<std::uint32_t> sizes; ///< per set

  /// \param root gives one element of a set, the same for all its elements
  template <typename Root>
  Partition(std::size_t count, const Root& root) : set(count)
  {
    constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> numbers(count, none); // at the roots
    for (std::uint32_t i = 0; i < count; ++i) {
      std::uint32_t& number = numbers[root(i)];
      if (number == none) {
        number = static_cast<std::uint32_t>(sizes.size());
        sizes.push_back(0);
      }
      set[i] = number;
      ++sizes[number];
    }
  }

  /// True on the first call for i's set: if called with ascending i, i is the smallest element of its set.
  bool isFirst(std::size_t i, std::vector<std::uint8_t>& seen) const
  {
    return std::exchange(seen[set[i]], std::uint8_t{1}) == 0;
  }
};

} // namespace pcl::mrf
