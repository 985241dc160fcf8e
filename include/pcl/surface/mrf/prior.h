/// \file
/// \brief The priors (paper Sec. 3.3.1) as powers of the graph Laplacian on a voxel lattice.
#pragma once

namespace pcl {
namespace mrf {

/// Order k of the prior; the system's operator is L^k.
enum class Prior {
  membrane = 1,   ///< differences of neighbours (paper Eq. 5, 9, 13)
  thinPlate = 2,  ///< the fixed point of the paper's ICM for its Laplacian prior (Eq. 6)
  triharmonic = 3 ///< the exact minimiser of the sum of Eq. 6 over all voxels
};

/// Which energy is minimised.
enum class Energy {
  joint,   ///< Eq. 9 / 13: L^k d + c_k W (d − d°) = 0 with w = a/(1−a)
  weighted ///< Eq. 10–11: the prior of voxel i is weighted by (1−a_i) as well, its data by a_i; has another minimiser
};

struct PriorOptions {
  Prior prior = Prior::triharmonic;
  float beta = .99f; ///< global weight of the data β, [0, 1); larger trusts the data more
  Energy energy = Energy::joint;
};

/// \throw InvalidOption naming the first field that is out of range
void validate(const PriorOptions& options);

/// Order k of a prior: 1, 2 or 3.
inline int order(Prior prior)
{
  return static_cast<int>(prior);
}

/// c_k: the centre coefficient of L^k in the interior, 6, 42 or 324.
inline int centreCoefficient(Prior prior)
{
  return prior == Prior::membrane ? 6 : prior == Prior::thinPlate ? 42 : 324;
}

/// Length over which the prior smooths observed data, cloud's unit.
///
/// In the continuum h^(2k) Δ^k balances c_k w; the transfer function of a wave of number q is 1/(1 + (hq)^(2k)/(c_k w))
/// and falls to one half at wavelength 2πℓ with ℓ = h (c_k w)^(−1/(2k)). It holds for fully observed voxels (α = 1); it
/// depends on h, which is why β has another meaning on every grid.
/// \pre 0 < beta < 1
double smoothingLength(const PriorOptions& options, double voxelSize);

} // namespace mrf
} // namespace pcl
