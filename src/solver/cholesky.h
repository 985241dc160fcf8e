// SPDX-License-Identifier: BSD-3-Clause
/// Sparse Cholesky factorization (paper Sec. 3.4.3), by CHOLMOD.
#pragma once

#include "solver/linear_system.h"

#include <pcl/surface/mrf/report.h>

namespace pcl::mrf {

/// Bytes that the factorization of a system on a grid of this size takes besides the system.
/// \param pointwise the data couple the voxels of a cell, as observations at points do
double choleskyBytes(const GridSize& size, Prior prior, bool pointwise);

/// Seconds that the factorization takes one processor of 2020.
double choleskySeconds(const GridSize& size, Prior prior, bool pointwise);

/// Max seconds of a factorization; longer ones are refused, as they cannot be cancelled once they have begun.
constexpr double maxCholeskySeconds = 16;

/// \throw SolverFailure if the module libpcl_mrf_cholesky cannot be loaded
void requireCholesky();

/// Factorizes the system in double precision and solves it on one thread; the guess in d is not used. CHOLMOD is given
/// the order of elimination, by nested dissection of the grid, see src/method.md.
/// \throw SolverFailure if the module cannot be loaded, or the matrix is not positive definite
/// \throw ResourceLimit if it takes more memory than is free, or longer than maxCholeskySeconds
SolveReport solveCholesky(const LinearSystem& system, std::vector<double>& d, Execution& execution);

} // namespace pcl::mrf
