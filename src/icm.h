/// \file
/// \brief Iterated conditional modes (paper Sec. 3.4).
#pragma once

#include <pcl/surface/mrf/solver.h>

namespace pcl {
namespace mrf {

/// Minimises the energy over one voxel at a time given the others. Stops on SolverOptions::changeTolerance.
///
/// The paper visits the voxels in random order. Here they are cut into colour classes whose members do not interact;
/// the order of the classes is shuffled for every sweep, and the members of one class are updated together: the same as
/// any order among them, so the result depends on the seed alone.
template <typename Real>
SolveReport solveIcm(const LinearSystem<Real>& system, const SolverOptions& options, double unit, std::vector<Real>& d,
                     Execution& execution);

} // namespace mrf
} // namespace pcl
