// SPDX-License-Identifier: BSD-3-Clause
/// The zero level of a distance field, as the remesher follows it.
#pragma once

#include "remesher/reference_surface.h"

#include <pcl/surface/mrf/distance_field.h>

#include <Eigen/Core>

#include <optional>

namespace pcl::mrf {

/// Refers to the field, which must outlive it.
class ZeroLevel : public ReferenceSurface {
public:
  ZeroLevel(const DistanceField& field, float maxStep) : ReferenceSurface(maxStep), field_(field) {}

  const DistanceField& field() const { return field_; }

  /// Unit normal of the field, or the fallback where its gradient vanishes.
  Eigen::Vector3f normalAt(const Eigen::Vector3f& position, const Eigen::Vector3f& fallback) const override;

  /// Follows the gradient to the zero level; reaches nothing if it vanishes on the way, too.
  std::optional<Corner> trace(const Eigen::Vector3f& start) const override;

  float height(const Eigen::Vector3f& position) const override;

private:
  const DistanceField& field_;
};

} // namespace pcl::mrf
