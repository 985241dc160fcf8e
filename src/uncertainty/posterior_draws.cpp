// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/posterior_draws.h"

#include "base/loops.h"
#include "field/prior.h"
#include "solver/grid_solver.h"

#include <algorithm>

namespace pcl::mrf {
namespace {

/// Voxels, or random numbers, per piece of parallel work; even.
constexpr std::int64_t drawGrain = 1 << 14;

/// The first random numbers of a kind.
std::vector<float> drawOf(NormalDraws::Kind kind, std::int64_t count, const NormalDraws& draws, Execution& execution)
{
  std::vector<float> values(count);
  execution.forRange(count, drawGrain, [&](std::int64_t begin, std::int64_t end) { // begin is even
    for (std::int64_t v = begin; v < end; v += 2) {
      const std::array<float, 2> pair = draws.pair(kind, static_cast<std::uint64_t>(v / 2));
      values[v] = pair[0];
      if (v + 1 < end)
        values[v + 1] = pair[1];
    }
  });
  return values;
}

/// Dᵀξ: each edge adds its number at its start and subtracts it at its end.
std::vector<double> drawOfDifferences(const GridSize& size, const NormalDraws& draws, Execution& execution)
{
  // Three edges per voxel, along x, y and z; edges that lead out of the grid are not used.
  const std::vector<float> edges = drawOf(NormalDraws::Kind::edges, 3 * size.count(), draws, execution);
  std::vector<double> values(size.count());
  const std::int64_t stride = size.x, plane = size.planeCount();
  forEach<int>(execution, size.z, 1, [&](int z) {
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) {
        const std::int64_t voxel = size.index(x, y, z);
        const float along = (x + 1 < size.x ? edges[3 * voxel] : 0) - (x > 0 ? edges[3 * (voxel - 1)] : 0);
        const float across =
            (y + 1 < size.y ? edges[3 * voxel + 1] : 0) - (y > 0 ? edges[3 * (voxel - stride) + 1] : 0);
        const float up = (z + 1 < size.z ? edges[3 * voxel + 2] : 0) - (z > 0 ? edges[3 * (voxel - plane) + 2] : 0);
        values[voxel] = static_cast<double>(along + across + up);
      }
  });
  return values;
}

/// L x
std::vector<double> laplacianOf(const GridSize& size, const std::vector<double>& x, Execution& execution)
{
  std::vector<double> result(x.size());
  forEach<int>(execution, size.z, 1, [&](int z) {
    for (int j = 0; j < size.y; ++j) {
      const auto row = [&](int y, int above) { // at the grid's border: the row itself
        return x.data() + size.index(0, std::clamp(y, 0, size.y - 1), std::clamp(above, 0, size.z - 1));
      };
      const double *const center = row(j, z), *const south = row(j - 1, z), *const north = row(j + 1, z),
                          *const below = row(j, z - 1), *const above = row(j, z + 1);
      double* const out = result.data() + size.index(0, j, z);
      for (int i = 0; i < size.x; ++i) {
        const double across = 4 * center[i] - ((south[i] + north[i]) + (below[i] + above[i]));
        const bool isFirst = i == 0, isLast = i + 1 == size.x;
        const double along = isFirst && isLast ? 0
                             : isFirst         ? center[i] - center[i + 1]
                             : isLast          ? center[i] - center[i - 1]
                                               : 2 * center[i] - (center[i - 1] + center[i + 1]);
        out[i] = along + across;
      }
    }
  });
  return result;
}

/// A factor of L^k times ξ.
std::vector<double> drawOfPrior(const GridSize& size, Prior prior, const NormalDraws& draws, Execution& execution)
{
  std::vector<double> values;
  if (order(prior) % 2 != 0) {
    values = drawOfDifferences(size, draws, execution);
  } else {
    const std::vector<float> voxels = drawOf(NormalDraws::Kind::voxels, size.count(), draws, execution);
    values.assign(voxels.begin(), voxels.end());
  }
  return order(prior) > 1 ? laplacianOf(size, values, execution) : values;
}

} // namespace

PackedValues drawOfTerms(const SolverGrid& grid, const GridSize& size, Prior prior, const NormalDraws& draws,
                         Execution& execution)
{
  PackedValues eta;
  sumRightHandSide(grid, &draws, eta, execution);
  // Whole grids are packed in the order of their lattice.
  const std::vector<double> ofPrior = drawOfPrior(size, prior, draws, execution);
  forEach(execution, size.count(), drawGrain, [&](std::size_t v) { eta[v] += static_cast<float>(ofPrior[v]); });
  return eta;
}

std::vector<float> drawOfPosterior(const std::vector<SolverGrid>& grids, const GridSize& size, Prior prior,
                                   const NormalDraws& draws, int steps, Execution& execution)
{
  const PackedValues eta = drawOfTerms(grids.front(), size, prior, draws, execution);
  std::vector<float> result(size.count(), 0);
  SolverOptions solver;
  solver.changeTolerance = 0; // this tolerance is for voxels near a zero level, which a draw does not have
  LevelPlan plan{steps};
  plan.threads = execution.threads();
  solveOnGrids({grids, prior, grids.front().voxels, &eta}, plan, solver, 1, result.data(), execution);
  return result;
}

} // namespace pcl::mrf
