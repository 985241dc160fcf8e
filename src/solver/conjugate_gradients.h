// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Fletcher–Reeves conjugate gradients on the energy (paper Sec. 3.4).
#pragma once

#include "solver/linear_system.h"

#include <pcl/surface/mrf/report.h>

namespace pcl::mrf {

/// Minimizes the energy along conjugate directions without a preconditioner. The energy is quadratic, so the line
/// search is exact and the method is linear conjugate gradients. Stops on SolverOptions::residualTolerance.
SolveReport solveConjugateGradients(const LinearSystem& system, const SolverOptions& options, std::vector<double>& d,
                                    Execution& execution);

} // namespace pcl::mrf
