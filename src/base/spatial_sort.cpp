// SPDX-License-Identifier: BSD-3-Clause
#include "base/spatial_sort.h"

#include "base/loops.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace pcl::mrf {
namespace {

constexpr int digitBits = 11;
constexpr std::size_t digits = std::size_t{1} << digitBits;

/// Keys per piece of parallel work: enough to make the cost of its histogram small.
constexpr std::size_t sortGrain = 1 << 16;

constexpr int axisBits = 21;

/// Sorts each run of equal keys by coordinates and index.
void sortTies(const SortKeys& keys, const std::vector<Eigen::Vector3f>& positions, std::vector<std::uint32_t>& order,
              Execution& execution)
{
  const auto isBefore = [&](std::uint32_t a, std::uint32_t b) {
    const Eigen::Vector3f &p = positions[a], &q = positions[b];
    for (int axis = 0; axis < 3; ++axis)
      if (p[axis] != q[axis])
        return p[axis] < q[axis];
    return a < b;
  };
  execution.forRange(keys.size(), sortGrain, [&](std::int64_t from, std::int64_t to) {
    // A run belongs to the piece of work in which it begins.
    for (auto begin = static_cast<std::size_t>(from); begin < static_cast<std::size_t>(to);) {
      const bool isBeginning = begin == 0 || keys[begin - 1] != keys[begin];
      const std::size_t limit = isBeginning ? keys.size() : static_cast<std::size_t>(to);
      std::size_t end = begin + 1;
      while (end < limit && keys[end] == keys[begin])
        ++end;
      if (isBeginning && end - begin > 1)
        std::sort(order.begin() + begin, order.begin() + end, isBefore);
      begin = end;
    }
  });
}

/// Sorts keys by the bits from lowestBit on. For each key, move(from, to) copies the key's value to a second array;
/// swap() exchanges the two arrays.
template <typename Keys, typename Move, typename Swap>
void radixSort(Keys& keys, int lowestBit, const Move& move, const Swap& swap, Execution& execution)
{
  const std::size_t count = keys.size();
  std::uint64_t used = 0;
  for (const std::uint64_t key : keys)
    used |= key;
  Keys otherKeys(count);
  const std::size_t chunks = (count + sortGrain - 1) / sortGrain;
  std::vector<std::array<std::uint32_t, digits>> offsets(chunks);
  const auto forChunks = [&](const auto& body) {
    execution.forRange(count, sortGrain, [&](std::int64_t begin, std::int64_t end) {
      body(offsets[static_cast<std::size_t>(begin) / sortGrain], static_cast<std::size_t>(begin),
           static_cast<std::size_t>(end));
    });
  };
  for (int shift = lowestBit; shift < 64 && used >> shift != 0; shift += digitBits) {
    const auto digitOf = [shift](std::uint64_t key) { return static_cast<std::size_t>(key >> shift) & (digits - 1); };
    if (digitOf(used) == 0)
      continue;
    forChunks([&](auto& histogram, std::size_t begin, std::size_t end) {
      histogram.fill(0);
      for (std::size_t i = begin; i < end; ++i)
        ++histogram[digitOf(keys[i])];
    });
    std::uint32_t total = 0;
    for (std::size_t digit = 0; digit < digits; ++digit)
      for (auto& histogram : offsets)
        total += std::exchange(histogram[digit], total);
    forChunks([&](auto& next, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t target = next[digitOf(keys[i])]++;
        otherKeys[target] = keys[i];
        move(i, target);
      }
    });
    keys.swap(otherKeys);
    swap();
  }
}

} // namespace

void sortByKey(SortKeys& keys, std::vector<std::uint32_t>& values, Execution& execution)
{
  std::vector<std::uint32_t> otherValues(values.size());
  radixSort(
      keys, 0, [&](std::size_t from, std::size_t to) { otherValues[to] = values[from]; },
      [&] { values.swap(otherValues); }, execution);
}

void sortByUpperHalf(std::vector<std::uint64_t>& values, Execution& execution)
{
  radixSort(
      values, 32, [](std::size_t, std::size_t) {}, [] {}, execution);
}

std::vector<std::uint32_t> spatialOrder(const std::vector<Eigen::Vector3f>& positions,
                                        const std::vector<std::uint8_t>& keep, Execution& execution)
{
  std::vector<std::uint32_t> order;
  order.reserve(positions.size());
  Eigen::Array3f lower = Eigen::Array3f::Constant(std::numeric_limits<float>::max()), upper = -lower;
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (keep[i]) {
      order.push_back(static_cast<std::uint32_t>(i));
      lower = lower.min(positions[i].array());
      upper = upper.max(positions[i].array());
    }
  if (order.empty())
    return order;

  // In double, because the extent of finite floats may overflow a float.
  const Eigen::Array3d origin = lower.cast<double>();
  const double extent = (upper.cast<double>() - origin).maxCoeff();
  const double scale = extent > 0 ? ((1 << axisBits) - 1) / extent : 0;
  SortKeys keys(order.size());
  forEach(execution, order.size(), sortGrain, [&](std::size_t n) {
    const Eigen::Array3i cell = ((positions[order[n]].array().cast<double>() - origin) * scale).cast<int>();
    keys[n] = mortonCode(static_cast<std::uint32_t>(cell.x()), static_cast<std::uint32_t>(cell.y()),
                         static_cast<std::uint32_t>(cell.z()));
  });
  sortByKey(keys, order, execution);
  sortTies(keys, positions, order, execution);
  return order;
}

} // namespace pcl::mrf
