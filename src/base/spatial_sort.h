// SPDX-License-Identifier: BSD-3-Clause
/// Sorts positions so that neighbors in space are neighbors in memory.
#pragma once

#include "base/arrays.h"

#include <pcl/surface/mrf/execution.h>

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Spreads the lowest 21 bits of a number, with two zeros between each.
constexpr std::uint64_t spreadBits(std::uint64_t value)
{
  value &= 0x1fffff;
  value = (value | value << 32) & 0x1f00000000ffff;
  value = (value | value << 16) & 0x1f0000ff0000ff;
  value = (value | value << 8) & 0x100f00f00f00f00f;
  value = (value | value << 4) & 0x10c30c30c30c30c3;
  value = (value | value << 2) & 0x1249249249249249;
  return value;
}

/// Morton code of a cell, 21 bits per axis.
constexpr std::uint64_t mortonCode(std::uint32_t x, std::uint32_t y, std::uint32_t z)
{
  return spreadBits(x) | spreadBits(y) << 1 | spreadBits(z) << 2;
}

using SortKeys = std::vector<std::uint64_t, UninitializedAllocator<std::uint64_t>>;

/// Sorts the keys and, with them, the values, by a parallel radix sort; equal keys keep their order.
void sortByKey(SortKeys& keys, std::vector<std::uint32_t>& values, Execution& execution);

/// Sorts by the upper 32 bits; values with equal upper bits keep their order.
void sortByUpperHalf(std::vector<std::uint64_t>& values, Execution& execution);

/// Indices of the flagged positions along a Morton curve. Positions in the same cell (2⁻²¹ of the bounding box) are
/// ordered by coordinates, equal positions by index, so that the order of the input does not matter.
/// \pre the flagged positions are finite; keep.size() == positions.size()
std::vector<std::uint32_t> spatialOrder(const std::vector<Eigen::Vector3f>& positions,
                                        const std::vector<std::uint8_t>& keep, Execution& execution);

} // namespace pcl::mrf
