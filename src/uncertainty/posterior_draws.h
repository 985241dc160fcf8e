// SPDX-License-Identifier: BSD-3-Clause
/// Draws from the posterior of a level that is solved everywhere (ours).
///
/// The energy's minimizer solves A d = b, A = L^k + C; up to the variance of the data, A⁻¹ is the covariance of the
/// posterior. A solution of A e = η with η ~ N(0, A) has just that covariance (perturb and MAP, Papandreou and Yuille
/// 2010), and η is drawn term by term: √w ξ through each row of the data, and a factor of L^k. With D the differences
/// along the lattice's edges, L = DᵀD, the factor is L^(k/2) for an even k and L^((k−1)/2) Dᵀ for an odd one.
#pragma once

#include "base/arrays.h"
#include "base/random.h"
#include "solver/grids.h"

#include <pcl/surface/mrf/options.h>

#include <vector>

namespace pcl::mrf {

/// η ~ N(0, L^k + C), packed. \param grid whole \param size of its lattice
/// The result does not depend on the number of threads.
PackedValues drawOfTerms(const SolverGrid& grid, const GridSize& size, Prior prior, const NormalDraws& draws,
                         Execution& execution);

/// e ~ N(0, A⁻¹), one value per voxel, as far as the solver comes. \param grids whole, finest first \param size of the
/// finest lattice \param steps of conjugate gradients, at most; fewer once the residual is 1e-6 of what it was
/// \throw SolverFailure, Cancelled
std::vector<float> drawOfPosterior(const std::vector<SolverGrid>& grids, const GridSize& size, Prior prior,
                                   const NormalDraws& draws, int steps, Execution& execution);

} // namespace pcl::mrf
