/// \file
/// \brief Sparse Cholesky factorisation through CHOLMOD (paper Sec. 3.4).
#pragma once

#include <pcl/surface/mrf/solver.h>

namespace pcl {
namespace mrf {

/// Solves the system directly, in double precision; the initial guess does not matter.
/// \throw ResourceLimit if the factor would exceed SolverOptions::maxFactorBytes
/// \throw InvalidOption in a build without CHOLMOD
template <typename Real>
SolveReport solveCholesky(const LinearSystem<Real>& system, const SolverOptions& options, std::vector<Real>& d,
                          Execution& execution);

} // namespace mrf
} // namespace pcl
