// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The distance from a field's zero level to first order, d / |∇d|.
#pragma once

#include <Eigen/Core>

#include <algorithm>

namespace pcl::mrf {

/// What |∇d| is taken for at least and at most. It is 1 but for noise and creases: where noise has flattened the field
/// its values are small, where the field follows the noise its slope is large, and neither may pass for a small
/// distance.
struct SlopeLimits {
  float min, max;
};

constexpr SlopeLimits heldOutSlope{.1f, 1}; ///< at points that the field has not seen
constexpr SlopeLimits robustSlope{.3f, 1};  ///< where most points are outliers, perhaps
constexpr SlopeLimits vertexSlope{.3f, 1.5f};

inline float slopeWithin(const SlopeLimits& limits, const Eigen::Vector3f& gradient)
{
  return std::clamp(gradient.norm(), limits.min, limits.max);
}

} // namespace pcl::mrf
