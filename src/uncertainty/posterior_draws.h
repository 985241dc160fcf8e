// SPDX-License-Identifier: BSD-3-Clause
/// Draws from the posterior of a level that is solved everywhere (ours): solutions of A e = η with η ~ N(0, A), A = L^k
/// + C, drawn term by term: √w ξ through each row of the data, and a factor of L^k (perturb and MAP, Papandreou and
/// Yuille 2010). With D the differences along the lattice's edges, L = DᵀD, that is L^(k/2) for an even k, L^((k−1)/2)
/// Dᵀ else.
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
