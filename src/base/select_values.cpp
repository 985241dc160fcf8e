// SPDX-License-Identifier: BSD-3-Clause
#include "base/select_values.h"

#include <cstring>

namespace pcl::mrf {

float median(const std::vector<float>& values, Execution& execution)
{
  // The bits of such floats are ordered as they are. A bucket for each of the upper 16 bits holds few values.
  const auto bucketOf = [](float value) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    return std::size_t{bits >> 16};
  };
  using Histogram = std::vector<std::uint32_t>;
  constexpr std::size_t grain = std::size_t{1} << 18, buckets = std::size_t{1} << 16;
  std::vector<Histogram> parts((values.size() + grain - 1) / grain);
  execution.forRange(values.size(), grain, [&](std::size_t begin, std::size_t end) {
    Histogram& counts = parts[begin / grain];
    counts.assign(buckets, 0);
    for (std::size_t i = begin; i < end; ++i)
      ++counts[bucketOf(values[i])];
  });
  std::size_t rank = values.size() / 2, bucket = 0;
  for (;; ++bucket) {
    std::size_t count = 0;
    for (const Histogram& counts : parts)
      count += counts[bucket];
    if (rank < count)
      break;
    rank -= count;
  }
  std::vector<float> close;
  for (const float value : values)
    if (bucketOf(value) == bucket)
      close.push_back(value);
  const auto middle = close.begin() + rank;
  std::nth_element(close.begin(), middle, close.end());
  return *middle;
}

} // namespace pcl::mrf
