/// \file
/// \brief Fletcher–Reeves conjugate gradients on the energy (paper Sec. 3.4).
#pragma once

#include <pcl/surface/mrf/solver.h>

namespace pcl {
namespace mrf {

/// Minimises the energy along conjugate directions without a preconditioner. The energy is quadratic, so the line
/// search is exact and the method is linear conjugate gradients. Stops on SolverOptions::residualTolerance.
template <typename Real>
SolveReport solveConjugateGradients(const LinearSystem<Real>& system, const SolverOptions& options,
                                    std::vector<Real>& d, Execution& execution);

} // namespace mrf
} // namespace pcl
