// SPDX-License-Identifier: BSD-3-Clause
#include "field/interpolation.h"

#include <algorithm>
#include <cmath>

namespace pcl::mrf {
namespace {

/// Four coarse indices for each fine index along one axis.
struct Taps {
  std::vector<std::array<int, 4>> indices;

  Taps(double coarseOrigin, int coarseCount, double coarseSpacing, double fineOrigin, int fineCount)
  {
    for (int i = 0; i < fineCount; ++i) {
      const double position = (fineOrigin - coarseOrigin) / coarseSpacing + .5 * i;
      const int parent = static_cast<int>(std::lround(position));
      const int side = position > parent ? 1 : -1;
      std::array<int, 4> index{};
      for (int tap = 0; tap < 4; ++tap)
        index[tap] = std::clamp(parent + side * (tap - 1), 0, coarseCount - 1);
      indices.push_back(index);
    }
  }
};

/// out = Σ weight · row over four rows.
void combineRows(const std::array<float, 4>& weights, const std::array<const float*, 4>& rows, int count, float* out)
{
  for (int x = 0; x < count; ++x)
    out[x] = weights[0] * rows[0][x] + weights[1] * rows[1][x] + weights[2] * rows[2][x] + weights[3] * rows[3][x];
}

/// The tensor product of these weights.
std::vector<float> interpolate(const std::array<float, 4>& weights, const std::vector<float>& values,
                               const Lattice& coarse, const Lattice& fine, Execution& execution)
{
  const auto taps = [&](int axis, int coarseCount, int fineCount) {
    return Taps(coarse.origin[axis], coarseCount, coarse.spacing, fine.origin[axis], fineCount);
  };
  const GridSize from = coarse.size, to = fine.size;
  const Taps alongX = taps(0, from.x, to.x), alongY = taps(1, from.y, to.y), alongZ = taps(2, from.z, to.z);

  // Coarse planes with fine rows and columns, then planes combined along z.
  const GridSize middle{to.x, to.y, from.z};
  std::vector<float> planes(static_cast<std::size_t>(middle.count()));
  execution.forRange(from.z, 1, [&](std::int64_t begin, std::int64_t end) {
    std::vector<float> rows(static_cast<std::size_t>(to.x) * static_cast<std::size_t>(from.y));
    for (int z = static_cast<int>(begin); z < static_cast<int>(end); ++z) {
      for (int y = 0; y < from.y; ++y) {
        const float* row = values.data() + from.index(0, y, z);
        float* out = rows.data() + std::int64_t{to.x} * y;
        for (int x = 0; x < to.x; ++x) {
          const auto& index = alongX.indices[x];
          out[x] = weights[0] * row[index[0]] + weights[1] * row[index[1]] + weights[2] * row[index[2]] +
                   weights[3] * row[index[3]];
        }
      }
      for (int y = 0; y < to.y; ++y) {
        const auto& index = alongY.indices[y];
        std::array<const float*, 4> sources{};
        for (std::size_t tap = 0; tap < 4; ++tap)
          sources[tap] = rows.data() + std::int64_t{to.x} * index[tap];
        combineRows(weights, sources, to.x, planes.data() + middle.index(0, y, z));
      }
    }
  });

  std::vector<float> result(static_cast<std::size_t>(to.count()));
  execution.forRange(to.z, 1, [&](std::int64_t begin, std::int64_t end) {
    for (int z = static_cast<int>(begin); z < static_cast<int>(end); ++z) {
      const auto& index = alongZ.indices[z];
      for (int y = 0; y < to.y; ++y) {
        std::array<const float*, 4> sources{};
        for (std::size_t tap = 0; tap < 4; ++tap)
          sources[tap] = planes.data() + middle.index(0, y, index[tap]);
        combineRows(weights, sources, to.x, result.data() + to.index(0, y, z));
      }
    }
  });
  return result;
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
