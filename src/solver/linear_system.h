// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The system of one level in its plain form, in double precision: what ICM, conjugate gradients and Cholesky
/// solve, and what the grids of the multigrid solver are tested against.
#pragma once

#include "observation/observation.h"
#include "observation/point_observation.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/lattice.h>
#include <pcl/surface/mrf/report.h>

#include <Eigen/SparseCore>

#include <vector>

namespace pcl {
namespace mrf {

/// The operator of the prior: L^k, or with voxel weights v (Energy::weighted)
/// k = 1: L_v, k = 2: L V L, k = 3: L L_v L, where L_v = Σ over edges (i,j) of ½(v_i+v_j)(e_i−e_j)(e_i−e_j)ᵀ.
/// Borders are clamped: missing neighbors are dropped. Symmetric, positive semidefinite, annihilates constants.
struct PriorOperator {
  GridSize size;
  Prior kind = Prior::triharmonic;
  std::vector<double> voxelWeights; ///< v, one per voxel, ≥ 0; empty: 1 everywhere
};

/// y = P x. \pre x and y hold size.count() values and do not overlap \param scratch of the same size, from k = 2 on
void apply(const PriorOperator& prior, const double* x, double* y, std::vector<double>& scratch, Execution& execution);

using DataMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor, std::int64_t>;

/// (P + C) d = b on all voxels of a grid, symmetric positive definite as soon as one voxel is observed.
struct LinearSystem {
  PriorOperator prior;
  DataMatrix data; ///< C
  std::vector<double> rightHandSide;
  std::vector<PointSample> samples; ///< that C was made of; none: of voxels, and it is diagonal
  PointWeights weights;             ///< of the samples
  double unit = 1;                  ///< of the field, per voxel, with samples

  GridSize size() const { return prior.size; }
  bool isDiagonal() const { return samples.empty(); }
};

/// w = a/(1 − a), a = αβ clamped to 1 − 10⁻⁶: an infinite weight would leave a voxel without any prior.
double dataWeight(double confidence, double beta);

/// The voxel-wise system of the paper. a_i = α_i β.
/// Energy::joint: (L^k + c_k W) d = c_k W d°, w_i = a_i / (1 − a_i) with a_i clamped to 1 − 10⁻⁶.
/// Energy::weighted: (P_v + c_k A) d = c_k A d° with v_i = 1 − a_i; for constant a the same as joint.
/// Energy::paperText: as joint, with 36/7 or 18 in place of c_2 or c_3.
LinearSystem assemble(const Observation& observation, const PriorOptions& options);

/// The system of observations at points: C = Σ ρ (value · ccᵀ + gradient · GᵀG), b = unit · Σ ρ · gradient · Gᵀn,
/// blocks of 27 voxels on the occupied cells. Points beyond the outermost voxel centers observe the linear continuation
/// of the field. \param samples on the grid, in any order
LinearSystem assembleAtPoints(const GridSize& size, Prior prior, std::vector<PointSample> samples,
                              const PointWeights& weights, double unit, Execution& execution);

/// Products with a system; keeps its scratch memory from one to the next.
class SystemProduct {
public:
  /// \pre the system outlives it
  explicit SystemProduct(const LinearSystem& system);

  /// y = (P + C) x
  void apply(const std::vector<double>& x, std::vector<double>& y, Execution& execution);

  /// r = b − (P + C) x. \return ‖r‖²
  double residual(const std::vector<double>& x, std::vector<double>& r, Execution& execution);

private:
  const LinearSystem& system_;
  std::vector<double> scratch_;
};

/// Solves (P + C) d = b.
/// \param system at least one voxel must be observed
/// \param unit length of one voxel side in the unit of d; scales changeTolerance only
/// \param d in: initial guess, size().count() values; out: the solution
/// \throw SolverFailure if no voxel is observed, the result is not finite, or the factorization fails
/// \throw ResourceLimit if cholesky's factor would exceed maxFactorBytes
/// The result does not depend on the number of threads.
SolveReport solve(const LinearSystem& system, const SolverOptions& options, double unit, std::vector<double>& d,
                  Execution& execution);

/// ½ dᵀ(P + C)d − bᵀd per voxel: what every solver lowers.
double energy(const LinearSystem& system, const std::vector<double>& d, Execution& execution);

/// ‖b − (P + C) d‖ / ‖b‖.
double relativeResidual(const LinearSystem& system, const std::vector<double>& d, Execution& execution);

} // namespace mrf
} // namespace pcl
