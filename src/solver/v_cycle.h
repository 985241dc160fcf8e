// SPDX-License-Identifier: BSD-3-Clause
/// One multigrid V-cycle as a preconditioner.
#pragma once

#include "solver/grid_operator.h"

#include <Eigen/Cholesky>

#include <cstddef>
#include <vector>

namespace pcl::mrf {

/// Steps of the smoother in a V-cycle.
struct SmootherDegrees {
  int before, after; ///< the coarser grid's correction
  int coarsest;      ///< on the coarsest grid, if it is too large for a factor
};

/// The V-cycle of a hierarchy of grids, each with the operator discretized anew; a dense Cholesky factor on the
/// coarsest if it is small.
///
/// It is symmetric and positive definite if the degrees before and after are the same, but alone it diverges for k = 3
/// (and for k = 2 with few smoothing steps), because the coarse operators overcorrect; conjugate gradients do not mind.
class VCycle {
public:
  /// \param grids finest first; they outlive the cycle \param threads that sweep at the same time
  VCycle(const std::vector<SolverGrid>& grids, const PriorConstants& prior, const SmootherDegrees& degrees, int threads,
         Execution& execution);

  GridOperator& finest() { return *levels_.front().system; }
  std::vector<SweepScratch>& scratch() { return scratch_; }

  /// One V-cycle for A z = r from zero. \return z, valid until the next call
  const PackedValues& apply(const float* r, Execution& execution) { return cycle(0, r, execution); }

  /// A vector of the finest grid that is free between calls of apply.
  PackedValues& spare() { return levels_.front().before; }

private:
  struct Level {
    std::unique_ptr<GridOperator> system;
    PackedValues rightHandSide; ///< on all but the finest grid
    PackedValues before, after; ///< iterate before and after the coarse correction; after holds the residual, too
  };

  void factorizeCoarsest(Execution& execution);
  void solveCoarsest(const float* b, Level& level, Execution& execution);
  const PackedValues& cycle(std::size_t index, const float* b, Execution& execution);

  SmootherDegrees degrees_;
  std::vector<SweepScratch> scratch_;
  std::vector<Level> levels_;
  Eigen::LLT<Eigen::MatrixXd> coarsest_; ///< empty: the coarsest grid is smoothed instead
};

} // namespace pcl::mrf
