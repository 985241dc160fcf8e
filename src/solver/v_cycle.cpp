// SPDX-License-Identifier: BSD-3-Clause
#include "solver/v_cycle.h"

#include <pcl/surface/mrf/exceptions.h>

namespace pcl::mrf {
namespace {

/// Max unknowns of a coarsest grid with a dense factor, made column by column in a fraction of a millisecond.
constexpr std::int64_t factorizedUnknowns = 100;

} // namespace

VCycle::VCycle(const std::vector<SolverGrid>& grids, const PriorConstants& prior, const SmootherDegrees& degrees,
               int threads, Execution& execution)
    : degrees_(degrees), scratch_(static_cast<std::size_t>(threads))
{
  double tautness = prior.tautness;
  for (const SolverGrid& grid : grids) {
    const auto count = static_cast<std::size_t>(grid.voxels.count());
    if (!levels_.empty())
      levels_.back().system->connect(grid.voxels, execution);
    Level level;
    level.system = std::make_unique<GridOperator>(grid, prior, tautness, execution);
    if (!levels_.empty())
      level.rightHandSide.resize(count);
    level.before.resize(count);
    level.after.resize(count);
    levels_.push_back(std::move(level));
    tautness *= 2; // the same wave, with voxel sides twice as long
  }
  if (grids.size() > 1 && grids.back().voxels.count() <= factorizedUnknowns)
    factorizeCoarsest(execution);
}

void VCycle::factorizeCoarsest(Execution& execution)
{
  GridOperator& system = *levels_.back().system;
  const auto count = static_cast<Eigen::Index>(system.voxels().count());
  Eigen::MatrixXf columns(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::VectorXf unit = Eigen::VectorXf::Unit(count, i);
    system.multiply(system.voxels(), unit.data(), nullptr, columns.col(i).data(), scratch_, execution);
  }
  Eigen::MatrixXd matrix = columns.cast<double>();
  // Where the data weigh next to nothing, rounding may leave the matrix indefinite for constants. So much, relative to
  // the largest diagonal entry, prevents that and has no visible effect otherwise.
  constexpr double rounding = 1e-6;
  matrix = (.5 * (matrix + matrix.transpose())).eval();
  matrix.diagonal().array() += rounding * matrix.diagonal().maxCoeff();
  coarsest_.compute(matrix);
  if (coarsest_.info() != Eigen::Success)
    throw SolverFailure("multigrid: the matrix of the coarsest grid is not positive definite");
}

void VCycle::solveCoarsest(const float* b, Level& level, Execution& execution)
{
  if (coarsest_.rows() == 0) {
    Sweep sweep;
    sweep.source = Sweep::Source::zero;
    sweep.b = b;
    sweep.out = level.after.data();
    level.system->smooth(sweep, degrees_.coarsest, scratch_, execution);
    return;
  }
  Eigen::VectorXd solution = Eigen::Map<const Eigen::VectorXf>(b, coarsest_.rows()).cast<double>();
  coarsest_.solveInPlace(solution);
  Eigen::Map<Eigen::VectorXf>(level.after.data(), coarsest_.rows()) = solution.cast<float>();
}

const PackedValues& VCycle::cycle(std::size_t index, const float* b, Execution& execution)
{
  Level& level = levels_[index];
  if (index + 1 == levels_.size()) {
    solveCoarsest(b, level, execution);
    return level.after;
  }
  Level& coarse = levels_[index + 1];
  const VoxelSet& coarseVoxels = coarse.system->voxels();
  Sweep before;
  before.source = Sweep::Source::zero;
  before.b = b;
  before.out = level.before.data();
  before.product = level.after.data();
  before.isForCoarser = true;
  level.system->smooth(before, degrees_.before, scratch_, execution);
  level.system->restrictTo(level.after.data(), coarseVoxels, coarse.rightHandSide.data(), scratch_, execution);

  Sweep after;
  after.source = Sweep::Source::corrected;
  after.b = b;
  after.x = level.before.data();
  after.coarse = cycle(index + 1, coarse.rightHandSide.data(), execution).data();
  after.coarseVoxels = &coarseVoxels;
  after.out = level.after.data();
  level.system->smooth(after, degrees_.after, scratch_, execution);
  return level.after;
}

} // namespace pcl::mrf
