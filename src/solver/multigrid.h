// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Conjugate gradients in double precision, preconditioned by one V-cycle of the system's grids.
#pragma once

#include "solver/linear_system.h"

#include <pcl/surface/mrf/report.h>

namespace pcl {
namespace mrf {

/// Solves a system in its plain form with the multigrid of the levels (grid_solver.h) as preconditioner, which sees no
/// voxel weights. Stops on SolverOptions::residualTolerance or ::changeTolerance, whichever is reached first.
/// \param unit length of one voxel side in the unit of d
SolveReport solveMultigrid(const LinearSystem& system, const SolverOptions& options, double unit,
                           std::vector<double>& d, Execution& execution);

} // namespace mrf
} // namespace pcl
