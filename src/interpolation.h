/// \file
/// \brief Interpolation of a field from one level of the multiscale scheme to the next finer one.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/lattice.h>

#include <vector>

namespace pcl {
namespace mrf {

/// Tensor-product cubic interpolation at the centres of the finer voxels, a quarter of a coarse voxel off the coarse
/// centres: weights (−7, 105, 35, −5)/128, exact for cubic polynomials away from the border, clamped at it.
/// \pre the spacings differ by a factor of 2, the voxel faces coincide, and `coarse` covers `fine`
std::vector<float> interpolateCubic(const std::vector<float>& values, const Lattice& coarse, const Lattice& fine,
                                    Execution& execution);

} // namespace mrf
} // namespace pcl
