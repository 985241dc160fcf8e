// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Per-point arrays: some of their entries, the one in the middle.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

/// The flagged values, in their order; nothing of an empty array. \pre as many flags as values, unless there are none
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

/// The values with these indices, in that order; nothing of an empty array. \pre indices of values, unless there are
/// none
template <typename Value>
std::vector<Value> selectValues(const std::vector<Value>& values, const std::vector<std::uint32_t>& indices)
{
  std::vector<Value> selected;
  if (values.empty())
    return selected;
  selected.reserve(indices.size());
  for (const std::uint32_t i : indices)
    selected.push_back(values[i]);
  return selected;
}

/// The upper median. \pre not empty
inline float median(std::vector<float> values)
{
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The same without a copy, for many values. \pre not negative, not NaN
float median(const std::vector<float>& values, Execution& execution);

/// Clears flags by a criterion. \return how many it cleared
template <typename Rejects>
std::int64_t dropWhere(std::vector<std::uint8_t>& keep, const Rejects& rejects, Execution& execution)
{
  constexpr std::int64_t grain = 1 << 14;
  const double dropped =
      execution.sum(static_cast<std::int64_t>(keep.size()), grain, [&](std::int64_t begin, std::int64_t end) {
        std::int64_t count = 0;
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
          if (keep[i] && rejects(i)) {
            keep[i] = 0;
            ++count;
          }
        return static_cast<double>(count);
      });
  return static_cast<std::int64_t>(dropped);
}

} // namespace mrf
} // namespace pcl
