// SPDX-License-Identifier: BSD-3-Clause
#include "posterior_draws.h"

#include "grid_solver.h"
#include "linear_system.h"

#include <algorithm>

namespace pcl {
namespace mrf {
namespace {

/// Voxels per piece.
constexpr std::int64_t grain = 1 << 14;

std::vector<double> drawOfVoxels(std::int64_t count, const NormalDraws& draws, Execution& execution)
{
  std::vector<double> values(static_cast<std::size_t>(count));
  execution.forRange(count, grain, [&](std::int64_t begin, std::int64_t end) { // the grain is even
    for (std::int64_t v = begin; v < end; v += 2) {
      const std::array<float, 2> pair = draws.pair(NormalDraws::Kind::voxels, static_cast<std::uint64_t>(v));
      for (std::int64_t i = 0; i < std::min<std::int64_t>(2, end - v); ++i)
        values[static_cast<std::size_t>(v + i)] = pair[static_cast<std::size_t>(i)];
    }
  });
  return values;
}

/// The numbers of the edges that start at a voxel, along each axis.
std::array<float, 3> drawOfEdges(std::int64_t voxel, const NormalDraws& draws)
{
  const auto first = static_cast<std::uint64_t>(2 * voxel);
  const std::array<float, 2> xy = draws.pair(NormalDraws::Kind::edges, first);
  return {xy[0], xy[1], draws.pair(NormalDraws::Kind::edges, first + 1)[0]};
}

/// Dᵀξ.
std::vector<double> drawOfDifferences(const GridSize& size, const NormalDraws& draws, Execution& execution)
{
  std::vector<double> values(static_cast<std::size_t>(size.count()));
  const std::array<std::int64_t, 3> strides{1, size.x, size.planeCount()};
  execution.forRange(size.z, 1, [&](std::int64_t z, std::int64_t) {
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) {
        const std::int64_t voxel = size.index(x, y, static_cast<int>(z));
        const std::array<int, 3> at{x, y, static_cast<int>(z)}, last{size.x - 1, size.y - 1, size.z - 1};
        const std::array<float, 3> own = drawOfEdges(voxel, draws);
        double sum = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if (at[axis] < last[axis])
            sum += own[axis];
          if (at[axis] > 0)
            sum -= drawOfEdges(voxel - strides[axis], draws)[axis];
        }
        values[static_cast<std::size_t>(voxel)] = sum;
      }
  });
  return values;
}

/// A factor of L^k times ξ.
std::vector<double> drawOfPrior(const GridSize& size, Prior prior, const NormalDraws& draws, Execution& execution)
{
  const bool isOdd = order(prior) % 2 != 0;
  std::vector<double> values =
      isOdd ? drawOfDifferences(size, draws, execution) : drawOfVoxels(size.count(), draws, execution);
  const PriorOperator laplacian{size, Prior::membrane, {}};
  std::vector<double> product(values.size()), scratch;
  for (int power = 0; power < order(prior) / 2; ++power) {
    apply(laplacian, values.data(), product.data(), scratch, execution);
    values.swap(product);
  }
  return values;
}

} // namespace

PackedValues drawOfTerms(const SolverGrid& grid, const GridSize& size, Prior prior, const NormalDraws& draws,
                         Execution& execution)
{
  PackedValues eta;
  drawOfData(grid, draws, eta, execution);
  // Whole grids are packed in the order of their lattice.
  const std::vector<double> ofPrior = drawOfPrior(size, prior, draws, execution);
  execution.forRange(size.count(), grain, [&](std::int64_t begin, std::int64_t end) {
    for (auto v = static_cast<std::size_t>(begin); v < static_cast<std::size_t>(end); ++v)
      eta[v] += static_cast<float>(ofPrior[v]);
  });
  return eta;
}

std::vector<float> drawOfPosterior(const std::vector<SolverGrid>& grids, const GridSize& size, Prior prior,
                                   const NormalDraws& draws, int steps, Execution& execution)
{
  const PackedValues eta = drawOfTerms(grids.front(), size, prior, draws, execution);
  std::vector<float> result(static_cast<std::size_t>(size.count()), 0);
  SolverOptions solver;
  solver.changeTolerance = 0; // of all voxels near the zero level, which a draw does not have
  LevelPlan plan{steps};
  plan.threads = execution.threads();
  solveOnGrids(grids, prior, grids.front().voxels, plan, solver, 1, result.data(), execution, &eta);
  return result;
}

} // namespace mrf
} // namespace pcl
