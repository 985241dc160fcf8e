// SPDX-License-Identifier: BSD-3-Clause
/// Reads of a distance field at positions that are close to each other, and the distance from its zero level to first
/// order, d / |∇d|.
#pragma once

#include <pcl/surface/mrf/distance_field.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>

namespace pcl::mrf {

/// Distances and gradients as the field itself gives them, bit by bit. It keeps what it has read for the cell of the
/// last position, which two in three positions on the way to the zero level share. For one thread.
class FieldSampler {
public:
  explicit FieldSampler(const DistanceField& field) : field_(field) {}

  float sampleDistance(const Eigen::Vector3f& position, Eigen::Vector3f& gradient);

  /// Voxel side where that was read, cloud's unit. \pre something was
  float spacing() const;

private:
  void enter(const DistanceField& band, const Eigen::Array3i& cell);

  const DistanceField& field_;
  const DistanceField* band_ = nullptr; ///< that holds the last position, or a dense field
  Eigen::Array3i cell_ = Eigen::Array3i::Zero();
  std::array<Eigen::Array4f, 8> corners_; ///< gradient and distance at the cell's voxels, stored x first
};

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
