// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Iterated conditional modes (paper Sec. 3.4).
#pragma once

#include "solver/linear_system.h"

#include <pcl/surface/mrf/report.h>

namespace pcl {
namespace mrf {

/// Minimizes the energy over one voxel at a time given the others. Stops on SolverOptions::changeTolerance.
///
/// The paper visits the voxels in random order. Here they are cut into color classes whose members do not interact;
/// the order of the classes is shuffled for every sweep, and the members of one class are updated together: the same as
/// any order among them, so the result depends on the seed alone.
SolveReport solveIcm(const LinearSystem& system, const SolverOptions& options, double unit, std::vector<double>& d,
                     Execution& execution);

} // namespace mrf
} // namespace pcl
