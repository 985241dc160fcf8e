// SPDX-License-Identifier: BSD-3-Clause
/// Reading a distance field at positions that are close to each other, and limits of the slope |∇d| for the first-order
/// distance d / |∇d| from its zero level.
#pragma once

#include <pcl/surface/mrf/distance_field.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>

namespace pcl::mrf {

/// Gives the same distances and gradients as the field itself, bit by bit. It keeps the values of the last position's
/// cell: on the way to the zero level two in three positions are in the same cell as the one before. For one thread.
class FieldSampler {
public:
  explicit FieldSampler(const DistanceField& field) : field_(field) {}

  float sampleDistance(const Eigen::Vector3f& position, Eigen::Vector3f& gradient);

  /// Voxel side of the storage that the last position was read from, cloud's unit. \pre sampleDistance() was called
  float spacing() const;

private:
  void enter(const DistanceField& band, const Eigen::Array3i& cell);

  const DistanceField& field_;
  const DistanceField* band_ = nullptr; ///< the band, or the dense field, that the last position was read from
  Eigen::Array3i cell_ = Eigen::Array3i::Zero();
  std::array<Eigen::Array4f, 8> corners_; ///< gradient and distance at the cell's voxels, stored x first
};

/// The range that |∇d| is clamped to before d is divided by it. |∇d| is 1 but for noise and creases: noise that
/// flattens the field makes d small, and a field that follows the noise has a large |∇d|. Neither may pass for a small
/// distance.
struct SlopeLimits {
  float min, max;
};

constexpr SlopeLimits heldOutSlope{.1f, 1}; ///< at points that the field has not seen
constexpr SlopeLimits robustSlope{.3f, 1};  ///< where most points may be outliers
constexpr SlopeLimits vertexSlope{.3f, 1.5f};

inline float slopeWithin(const SlopeLimits& limits, const Eigen::Vector3f& gradient)
{
  return std::clamp(gradient.norm(), limits.min, limits.max);
}

} // namespace pcl::mrf
