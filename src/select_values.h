/// \file
/// \brief Dropping entries of per-point arrays.
#pragma once

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

} // namespace mrf
} // namespace pcl
