// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The priors (paper Sec. 3.3.1) as powers of the graph Laplacian on a voxel lattice.
#pragma once

#include <pcl/surface/mrf/options.h>

namespace pcl::mrf {

/// Order k of a prior: 1, 2 or 3.
inline int order(Prior prior)
{
  return static_cast<int>(prior);
}

/// c_k: the center coefficient of L^k in the interior, 6, 42 or 324.
inline int centerCoefficient(Prior prior)
{
  return prior == Prior::membrane ? 6 : prior == Prior::thinPlate ? 42 : 324;
}

/// Length over which the prior smooths observed data, cloud's unit.
///
/// In the continuum h^(2k) Δ^k balances c w, c being c_k, or 3 or 18 (Energy::paper); the transfer function of a wave
/// of number q is 1/(1 + (hq)^(2k)/(c w)) and falls to one half at wavelength 2πℓ with ℓ = h (c w)^(−1/(2k)). It holds
/// for fully observed voxels (α = 1); it depends on h, which is why β has another meaning on every grid. \pre 0 < beta
/// < 1
double smoothingLength(const PriorOptions& options, double voxelSize);

} // namespace pcl::mrf
