// SPDX-License-Identifier: BSD-3-Clause
/// Draws from the posterior of a level that is solved everywhere (ours): solutions of A e = η with η ~ N(0, A), A = L^k
/// + C. η is a sum of terms: √w ξ through each row of the data, and a factor of L^k times ξ (perturb and MAP,
/// Papandreou and Yuille 2010). With D the differences along the lattice's edges, L = DᵀD; the factor is L^(k/2) for an
/// even k, else L^((k−1)/2) Dᵀ.
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

/// e ~ N(0, A⁻¹), one value per voxel, up to the solver's accuracy. \param grids whole, finest first \param size of the
/// finest lattice \param steps maximum steps of conjugate gradients; fewer if the relative residual falls to 1e-6
/// \throw SolverFailure, Cancelled
std::vector<float> drawOfPosterior(const std::vector<SolverGrid>& grids, const GridSize& size, Prior prior,
                                   const NormalDraws& draws, int steps, Execution& execution);

} // namespace pcl::mrf
