// SPDX-License-Identifier: BSD-3-Clause
#include "points/point_frame.h"

#include "base/spatial_sort.h"

#include <algorithm>
#include <cmath>

namespace pcl {
namespace mrf {

std::vector<std::size_t> sampleOf(std::size_t count, std::size_t max)
{
  std::vector<std::size_t> sample(std::min(count, max));
  for (std::size_t n = 0; n < sample.size(); ++n)
    sample[n] = n * count / sample.size();
  return sample;
}

PointFrame estimateFrame(const std::vector<Eigen::Vector3f>& positions)
{
  const std::vector<std::size_t> sample = sampleOf(positions.size(), 4096);
  Eigen::Array3d lower, upper;
  std::vector<float> values(sample.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(sample.begin(), sample.end(), values.begin(), [&](std::size_t i) { return positions[i][axis]; });
    std::sort(values.begin(), values.end());
    // Far outliers must not decide the resolution.
    lower[axis] = values[values.size() / 50];
    upper[axis] = values[values.size() - 1 - values.size() / 50];
  }
  PointFrame frame;
  frame.center = .5 * (lower + upper);
  const double extent = (upper - lower).maxCoeff();
  if (!(extent > 0))
    return frame;

  constexpr int levels = 16;
  std::vector<std::uint64_t> codes;
  codes.reserve(sample.size());
  for (const std::size_t i : sample) {
    const Eigen::Array3d cell = (positions[i].array().cast<double>() - lower) * ((1 << levels) / extent);
    const Eigen::Array3i inside = cell.max(0).min((1 << levels) - 1).cast<int>();
    codes.push_back(mortonCode(static_cast<std::uint32_t>(inside.x()), static_cast<std::uint32_t>(inside.y()),
                               static_cast<std::uint32_t>(inside.z())));
  }
  std::sort(codes.begin(), codes.end());
  // From fine to coarse until the median point has company enough in its cell.
  constexpr double wanted = 5;
  double occupancy = 1;
  int level = levels;
  for (; level > 0; --level) {
    const auto cellAt = [&](std::size_t n) { return codes[n] >> 3 * (levels - level); };
    std::vector<std::uint32_t> sizes;
    for (std::size_t begin = 0, end = 0; begin < codes.size(); begin = end) {
      while (end < codes.size() && cellAt(end) == cellAt(begin))
        ++end;
      sizes.insert(sizes.end(), end - begin, static_cast<std::uint32_t>(end - begin));
    }
    std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
    occupancy = sizes[sizes.size() / 2];
    if (occupancy >= wanted)
      break;
  }
  const double sampled = static_cast<double>(sample.size()) / static_cast<double>(positions.size());
  frame.side = std::ldexp(extent, -level) * std::sqrt(sampled * wanted / occupancy);
  return frame;
}

} // namespace mrf
} // namespace pcl
