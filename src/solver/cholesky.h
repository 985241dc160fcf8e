// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Sparse Cholesky factorization (paper Sec. 3.4).
#pragma once

#include "solver/linear_system.h"
#include "solver/nested_dissection.h"

#include <pcl/surface/mrf/report.h>

namespace pcl {
namespace mrf {

/// What the factor of a system on a grid of this size takes.
/// \param pointwise the data couple the voxels of a cell, as observations at points do
FactorCost choleskyCost(const GridSize& size, Prior prior, bool pointwise);

/// \throw ResourceLimit if the factor would exceed SolverOptions::maxFactorBytes
void requireFactorFits(const GridSize& size, Prior prior, bool pointwise, const SolverOptions& options);

/// Bytes per voxel besides the factor: places, the right-hand side, and vectors to find the entries with.
constexpr double choleskyBytesPerVoxel = 36;

/// Factorizes the system in double precision and solves it; the guess in d is not used.
///
/// The voxels are ordered by nested dissection of the grid, so that the factor's structure follows from the grid alone:
/// its size and the work are known beforehand. Supernodes are factorized one after the other, their dense blocks in
/// pieces between which the run can be cancelled. Measured on 32³ voxels, k = 1, 2, 3: 1.5, 1.2 and 1.2 times the
/// numbers that METIS's ordering leaves (the corners' share is what counts), known without its second of analysis.
/// \throw ResourceLimit if the factor would exceed SolverOptions::maxFactorBytes
SolveReport solveCholesky(const LinearSystem& system, const SolverOptions& options, std::vector<double>& d,
                          Execution& execution);

} // namespace mrf
} // namespace pcl
