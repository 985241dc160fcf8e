// SPDX-License-Identifier: BSD-3-Clause
#include "field/interpolation.h"

#include "base/loops.h"

#include <algorithm>
#include <cmath>

namespace pcl::mrf {
namespace {

constexpr std::int64_t grainValues = 1 << 14;

/// Interpolates along one axis: every value is a weighted sum of four values on the same line.
std::vector<float> alongAxis(int axis, const std::array<float, 4>& weights, const std::vector<float>& values,
                             const Lattice& coarse, const Lattice& fine, const Eigen::Array3i& from,
                             Execution& execution)
{
  Eigen::Array3i to = from;
  to[axis] = Eigen::Array3i(fine.size.x, fine.size.y, fine.size.z)[axis];
  const std::int64_t step = from.head(axis).cast<std::int64_t>().prod(); // between neighbors along the axis
  std::vector<float> result(to.cast<std::int64_t>().prod());
  std::vector<std::array<int, 4>> taps(to[axis]);
  for (int i = 0; i < to[axis]; ++i) {
    const double position = (fine.origin[axis] - coarse.origin[axis]) / coarse.spacing + .5 * i;
    const int parent = static_cast<int>(std::lround(position)), side = position > parent ? 1 : -1;
    for (int tap = 0; tap < 4; ++tap)
      taps[i][tap] = std::clamp(parent + side * (tap - 1), 0, from[axis] - 1);
  }
  // Lines along the axis that lie side by side in memory are interpolated together.
  const std::int64_t groups = static_cast<std::int64_t>(result.size()) / (step * to[axis]);
  const std::int64_t grain = std::max<std::int64_t>(grainValues / step, 1);
  forEach<std::int64_t>(execution, groups * to[axis], grain, [&](std::int64_t n) {
    const float* const first = values.data() + step * from[axis] * (n / to[axis]);
    const auto& tap = taps[n % to[axis]];
    const std::array<const float*, 4> rows = {first + step * tap[0], first + step * tap[1], first + step * tap[2],
                                              first + step * tap[3]};
    float* const out = result.data() + step * n;
    for (std::int64_t x = 0; x < step; ++x)
      out[x] = weights[0] * rows[0][x] + weights[1] * rows[1][x] + weights[2] * rows[2][x] + weights[3] * rows[3][x];
  });
  return result;
}

/// Interpolates along all three axes by the same weights.
std::vector<float> interpolate(const std::array<float, 4>& weights, const std::vector<float>& values,
                               const Lattice& coarse, const Lattice& fine, Execution& execution)
{
  const GridSize from = coarse.size, to = fine.size;
  const std::vector<float> planes =
      alongAxis(1, weights, alongAxis(0, weights, values, coarse, fine, {from.x, from.y, from.z}, execution), coarse,
                fine, {to.x, from.y, from.z}, execution);
  return alongAxis(2, weights, planes, coarse, fine, {to.x, to.y, from.z}, execution);
}

} // namespace

std::vector<float> interpolateCubic(const std::vector<float>& values, const Lattice& coarse, const Lattice& fine,
                                    Execution& execution)
{
  return interpolate(cubicWeights, values, coarse, fine, execution);
}

std::vector<float> interpolateLinear(const std::vector<float>& values, const Lattice& coarse, const Lattice& fine,
                                     Execution& execution)
{
  return interpolate({0, .75f, .25f, 0}, values, coarse, fine, execution);
}

} // namespace pcl::mrf
