// SPDX-License-Identifier: BSD-3-Clause
/// Selects entries of arrays, medians and quantiles.
#pragma once

#include "base/loops.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace pcl::mrf {

/// The flagged values, in their order; empty for an empty array. \pre as many flags as values, unless there are none
template <typename Value>
std::vector<Value> selectValues(const std::vector<Value>& values, const std::vector<std::uint8_t>& keep)
{
  std::vector<Value> kept;
  if (values.empty())
    return kept;
  kept.reserve(values.size() - static_cast<std::size_t>(std::count(keep.begin(), keep.end(), std::uint8_t{0})));
  for (std::size_t i = 0; i < values.size(); ++i)
    if (keep[i])
      kept.push_back(values[i]);
  return kept;
}

/// The values with these indices, in that order; empty for an empty array. \pre indices of values, if there are any
template <typename Value, typename Index>
std::vector<Value> selectValues(const std::vector<Value>& values, const std::vector<Index>& indices)
{
  std::vector<Value> selected;
  if (values.empty())
    return selected;
  selected.reserve(indices.size());
  for (const Index i : indices)
    selected.push_back(values[i]);
  return selected;
}

/// At most `max` of the indices from 0 to count − 1, spread evenly.
inline std::vector<std::uint32_t> spreadIndices(std::size_t count, std::size_t max)
{
  std::vector<std::uint32_t> indices(std::min(count, max));
  for (std::size_t n = 0; n < indices.size(); ++n)
    indices[n] = static_cast<std::uint32_t>(n * count / indices.size());
  return indices;
}

/// The value of a rank in ascending order. \pre rank < values.size()
template <typename Value>
Value valueAt(std::vector<Value> values, std::size_t rank)
{
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[rank];
}

/// The upper median. \pre not empty
template <typename Value>
Value median(std::vector<Value> values)
{
  const std::size_t rank = values.size() / 2;
  return valueAt(std::move(values), rank);
}

/// The value of the rank share · (size − 1), rounded down. \param share 0..1 \pre not empty
template <typename Value>
Value quantile(std::vector<Value> values, double share)
{
  const auto rank = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  return valueAt(std::move(values), rank);
}

/// The standard deviation of a Gaussian over the median of its absolute value.
constexpr double deviationPerMedian = 1.4826;

/// Clears the set flags whose index is rejected. \return how many it cleared
template <typename Rejects>
std::int64_t dropWhere(std::vector<std::uint8_t>& keep, const Rejects& rejects, Execution& execution)
{
  constexpr std::int64_t grain = 1 << 14;
  const double dropped = sumOver(execution, keep.size(), grain, [&](std::size_t i) {
    const bool isDropped = keep[i] && rejects(i);
    if (isDropped)
      keep[i] = 0;
    return isDropped ? 1. : 0.;
  });
  return static_cast<std::int64_t>(dropped);
}

} // namespace pcl::mrf
