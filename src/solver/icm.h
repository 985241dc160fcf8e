// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Iterated conditional modes (paper Sec. 3.4).
#pragma once

#include "solver/linear_system.h"

#include <pcl/surface/mrf/report.h>

namespace pcl::mrf {

/// Minimizes the energy over one voxel at a time given the others. Stops on SolverOptions::changeTolerance.
///
/// SolverMethod::icm visits the voxels in an order that is drawn anew for every sweep, one after the other, as the
/// paper does. SolverMethod::icmColors cuts them into classes of voxels that do not interact and draws the order of the
/// classes: the members of one are updated together, the same as in any order among them. Both depend on the seed, not
/// on the number of threads.
SolveReport solveIcm(const LinearSystem& system, const SolverOptions& options, double unit, std::vector<double>& d,
                     Execution& execution);

} // namespace pcl::mrf
