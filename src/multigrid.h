/// \file
/// \brief One V-cycle as a preconditioner, and conjugate gradients with it.
#pragma once

#include "smoother.h"

#include <pcl/surface/mrf/solver.h>

#include <Eigen/Cholesky>

#include <cstddef>
#include <vector>

namespace pcl {
namespace mrf {

/// The V-cycle of one system: cell-centred coarsening to ⌈n/2⌉, the operator rediscretised on every level, a dense
/// Cholesky factor on the coarsest.
///
/// It is symmetric and positive definite, but alone it diverges for k = 3 (and for k = 2 with few smoothing steps),
/// because the rediscretised coarse operator overcorrects; conjugate gradients do not mind.
template <typename Real>
class MultigridPreconditioner {
public:
  /// \param degree Chebyshev degree before and after, ≥ 1
  /// \pre the system outlives the preconditioner
  MultigridPreconditioner(const LinearSystem<Real>& system, int degree, Execution& execution);

  /// One V-cycle for A z = r from zero. \return z, valid until the next call
  const std::vector<Real>& apply(const std::vector<Real>& r, Execution& execution);

  /// A vector of the finest grid that is free between calls of apply.
  std::vector<Real>& spare();

  /// Bytes that the preconditioner of a system comes to hold, but for the points on its coarse grids.
  /// \param weighted, pointwise the system has voxel weights; its data couple voxels
  static double predictedBytes(const GridSize& size, Prior prior, bool weighted, bool pointwise, int degree,
                               int threads);

private:
  struct Level {
    LinearSystem<Real> own; ///< of the coarse levels
    const LinearSystem<Real>* system = nullptr;
    std::vector<Smoother<Real>> smoother; ///< one; none on the coarsest level
    std::vector<Real> rightHandSide;      ///< of the coarse levels
    std::vector<Real> before, after; ///< iterate before and after the coarse correction; after holds the residual, too
  };

  const std::vector<Real>& cycle(std::size_t level, const Real* b, Execution& execution);
  void factoriseCoarsest();

  std::vector<std::unique_ptr<Level>> levels_;
  Eigen::LLT<Eigen::MatrixXd> coarsest_;
};

/// Chebyshev degree before and after: the option, or its default.
int smootherDegree(const SolverOptions& options, Prior prior);

/// Conjugate gradients preconditioned by one V-cycle. Stops on SolverOptions::residualTolerance or ::changeTolerance,
/// whichever is reached first.
/// \param unit length of one voxel side in the unit of d
template <typename Real>
SolveReport solveMultigrid(const LinearSystem<Real>& system, const SolverOptions& options, double unit,
                           std::vector<Real>& d, Execution& execution);

} // namespace mrf
} // namespace pcl
