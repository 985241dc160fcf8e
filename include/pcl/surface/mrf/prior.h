// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The priors (paper Sec. 3.3.1) as powers of the graph Laplacian on a voxel lattice.
#pragma once

#include <pcl/surface/mrf/export.h>

namespace pcl {
namespace mrf {

/// Order k of the prior; the system's operator is L^k.
enum class Prior {
  membrane = 1,   ///< differences of neighbors (paper Eq. 5, 9, 13)
  thinPlate = 2,  ///< the fixed point of the paper's ICM for its Laplacian prior (Eq. 6)
  triharmonic = 3 ///< the exact minimizer of the sum of Eq. 6 over all voxels
};

/// Which energy is minimized; a = αβ, w = a/(1−a).
///
/// The paper has two readings of how much the data weigh beside its Laplacian prior. Its program moves a voxel to
/// a d° + (1−a) d̄, with d̄ the value that the prior alone asks for given the neighbors: the same as a weight of 42 w
/// beside L², and of c_k w beside any L^k. Its text defines U_L in Eq. 6, the squared differences of l_i = d_i − (mean
/// of its neighbors) to those of the 6 neighbors, and adds w_i (d_i − d°_i)². The derivative of U_L(d_i), which the
/// appendix sets to zero, is 7/18 (L² d)_i; that of the sum over all voxels, which meets every edge from both of its
/// ends, 1/9 (L³ d)_i. Beside 2 w (d_i − d°_i) these are weights of 36/7 w and 18 w. A β of .9 in the text smooths as
/// one of .52 (k = 2) or .33 (k = 3) in the program. For k = 1 both say the same (Eq. 9).
///
/// Eq. 10–11 meet every edge from both of its ends, too: their prior, as it is written, is twice that of
/// Energy::weighted. Here it counts once, so that a constant a gives what Energy::joint gives.
enum class Energy {
  joint,    ///< Eq. 9 / 13, the paper's program: L^k d + c_k W (d − d°) = 0
  weighted, ///< Eq. 10–11: the prior of voxel i is weighted by (1−a_i) as well, its data by a_i; has another minimizer
  paperText ///< the text for Eq. 6: L^k d + 6 W, 36/7 W, 18 W (d − d°) = 0 for k = 1, 2, 3
};

struct PriorOptions {
  Prior kind = Prior::triharmonic;
  float beta = .99f; ///< global weight of the data β, [0, 1); larger trusts the data more
  Energy energy = Energy::joint;
};

/// \throw InvalidOption naming the first field that is out of range
PCL_MRF_EXPORT void validate(const PriorOptions& options);

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

/// What multiplies W beside L^k, or A beside P_v: c_k, or with Energy::paperText 6, 36/7 or 18.
PCL_MRF_EXPORT double dataCoefficient(const PriorOptions& options);

/// Length over which the prior smooths observed data, cloud's unit.
///
/// In the continuum h^(2k) Δ^k balances c w, c the data's coefficient; the transfer function of a wave of number q is
/// 1/(1 + (hq)^(2k)/(c w)) and falls to one half at wavelength 2πℓ with ℓ = h (c w)^(−1/(2k)). It holds for fully
/// observed voxels (α = 1); it depends on h, which is why β has another meaning on every grid.
/// \pre 0 < beta < 1
PCL_MRF_EXPORT double smoothingLength(const PriorOptions& options, double voxelSize);

} // namespace mrf
} // namespace pcl
