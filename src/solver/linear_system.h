// SPDX-License-Identifier: BSD-3-Clause
/// The system of one level in its plain form, a sparse matrix in double precision. ICM, conjugate gradients and
/// Cholesky solve it, and the grids of the multigrid solver are tested against it.
#pragma once

#include "observation/observation.h"
#include "observation/point_observation.h"
#include "solver/nested_dissection.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/lattice.h>
#include <pcl/surface/mrf/report.h>

#include <Eigen/SparseCore>

#include <vector>

namespace pcl::mrf {

using SystemMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// A d = b on all voxels of a grid, symmetric positive definite as soon as one voxel is observed. Borders are clamped:
/// missing neighbors are dropped.
struct LinearSystem {
  GridSize size;
  Coupling coupling; ///< of the voxels by A
  SystemMatrix matrix;
  std::vector<double> rightHandSide;
  bool isObserved = false; ///< true if there are data of a positive weight
};

/// w = a/(1 − a), a = αβ clamped to 1 − 10⁻⁶: an infinite weight would leave a voxel without any prior.
double dataWeight(double confidence, double beta);

/// Entries of a row of the matrix where no border is near. \param pointwise true for observations at points
double entriesPerVoxel(Prior prior, bool pointwise);

/// The voxel-wise system of the paper. a_i = α_i β, clamped as by dataWeight.
/// Energy::joint: (L^k + c_k W) d = c_k W d°, w_i = a_i / (1 − a_i).
/// Energy::paper: half the derivative of Σ (1 − a_i) U(d_i) + a_i (d_i − d°_i)².
LinearSystem assemble(const Observation& observation, const PriorOptions& options, Execution& execution);

/// The system of observations at points: L^k + C, C = Σ ρ (value · ccᵀ + gradient · GᵀG), b = unit · Σ ρ · gradient ·
/// Gᵀn, blocks of 27 voxels on the occupied cells. Points beyond the outermost voxel centers observe the linear
/// continuation of the field.
/// \param samples on the grid, in any order \param unit of the field, per voxel
LinearSystem assembleAtPoints(const GridSize& size, Prior prior, const std::vector<PointSample>& samples,
                              const PointWeights& weights, double unit, Execution& execution);

/// Σ_j A_ij x_j
inline double rowTimes(const SystemMatrix& matrix, std::int64_t row, const std::vector<double>& x)
{
  double sum = 0;
  for (int at = matrix.outerIndexPtr()[row]; at < matrix.outerIndexPtr()[row + 1]; ++at)
    sum += matrix.valuePtr()[at] * x[matrix.innerIndexPtr()[at]];
  return sum;
}

/// y = A x
void multiply(const LinearSystem& system, const std::vector<double>& x, std::vector<double>& y, Execution& execution);

/// r = b − A x. \return ‖r‖²
double residual(const LinearSystem& system, const std::vector<double>& x, std::vector<double>& r, Execution& execution);

/// True if whole levels are solved in this form: by another solver than multigrid, or for Energy::paper, which
/// multigrid does not minimize. \param pointwise true for observations at points, whose energy is always joint
inline bool solvesPlainly(const SolverOptions& solver, const PriorOptions& prior, bool pointwise)
{
  return solver.method != SolverMethod::multigrid || (prior.energy == Energy::paper && !pointwise);
}

/// Solves A d = b. Multigrid, which solves levels in another form (grid_solver.h), is replaced by conjugate gradients.
/// \param unit length of one voxel side in the unit of d; scales changeTolerance only
/// \param d in: initial guess, size.count() values; out: the solution
/// \throw SolverFailure if no voxel is observed, the result is not finite, or the factorization fails
/// \throw ResourceLimit if the factorization would take too long or too much memory
/// The result does not depend on the number of threads.
SolveReport solve(const LinearSystem& system, const SolverOptions& options, double unit, std::vector<double>& d,
                  Execution& execution);

/// Iterated conditional modes (paper Sec. 3.4): minimizes the energy over one voxel at a time given the others. Stops
/// on SolverOptions::changeTolerance.
///
/// SolverMethod::icm visits the voxels in an order that is drawn anew for every sweep, one after the other, as the
/// paper does. SolverMethod::icmColors divides them into classes of voxels that do not interact and draws the order of
/// the classes: the voxels of a class are updated in parallel, which equals any order of them. Both depend on the seed,
/// not on the number of threads.
SolveReport solveIcm(const LinearSystem& system, const SolverOptions& options, double unit, std::vector<double>& d,
                     Execution& execution);

/// Fletcher–Reeves conjugate gradients (paper Sec. 3.4) without a preconditioner; the energy is quadratic, so the line
/// search is exact. Stops on SolverOptions::residualTolerance.
SolveReport solveConjugateGradients(const LinearSystem& system, const SolverOptions& options, std::vector<double>& d,
                                    Execution& execution);

/// ½ dᵀA d − bᵀd per voxel: what every solver lowers.
double energy(const LinearSystem& system, const std::vector<double>& d, Execution& execution);

/// ‖b − A d‖ / ‖b‖.
double relativeResidual(const LinearSystem& system, const std::vector<double>& d, Execution& execution);

} // namespace pcl::mrf
