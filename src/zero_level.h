// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The zero level of a distance field, as the remesher follows it.
#pragma once

#include "triangle_shape.h"

#include <pcl/surface/mrf/distance_field.h>

#include <Eigen/Core>

#include <optional>

namespace pcl {
namespace mrf {

/// Finds the surface near a position. Refers to the field, which must outlive it.
class ZeroLevel {
public:
  /// \param maxStep how far from a position the surface is looked for, cloud's unit
  ZeroLevel(const DistanceField& field, float maxStep) : field_(field), maxStep_(maxStep) {}

  float maxStep() const { return maxStep_; }

  /// Unit normal of the field, or the fallback where its gradient vanishes.
  Eigen::Vector3f normalAt(const Eigen::Vector3f& position, const Eigen::Vector3f& fallback) const;

  /// Follows the gradient to the zero level.
  /// \return what is reached, with its unit normal; nothing if it is too far, or the gradient vanishes on the way
  std::optional<Corner> trace(const Eigen::Vector3f& start) const;

private:
  const DistanceField& field_;
  float maxStep_;
};

} // namespace mrf
} // namespace pcl
