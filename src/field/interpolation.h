// SPDX-License-Identifier: BSD-3-Clause
/// Interpolation of a field from one level of the multiscale scheme to the next finer one.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/lattice.h>

#include <array>
#include <vector>

namespace pcl::mrf {

/// Weights of the coarse voxels parent − side, parent, parent + side and parent + 2 side for a child on that side of
/// its parent, along one axis.
constexpr std::array<float, 4> cubicWeights = {-7.f / 128, 105.f / 128, 35.f / 128, -5.f / 128};

/// Tensor-product cubic interpolation at the centers of the finer voxels, a quarter of a coarse voxel off the coarse
/// centers: weights cubicWeights, exact for cubic polynomials away from the border, clamped at it.
/// \pre the spacings differ by a factor of 2, the voxel faces coincide, and `coarse` covers `fine`
std::vector<float> interpolateCubic(const std::vector<float>& values, const Lattice& coarse, const Lattice& fine,
                                    Execution& execution);

/// Tensor-product linear interpolation at the same places: weights ¾ and ¼, exact for trilinear polynomials away from
/// the border, clamped at it. \pre as for interpolateCubic
std::vector<float> interpolateLinear(const std::vector<float>& values, const Lattice& coarse, const Lattice& fine,
                                     Execution& execution);

} // namespace pcl::mrf
