// SPDX-License-Identifier: BSD-3-Clause
/// The zero level of a distance field, as the remesher follows it.
#pragma once

#include "mesh/triangle_shape.h"

#include <pcl/surface/mrf/distance_field.h>

#include <Eigen/Core>

#include <optional>

namespace pcl::mrf {

/// The surface that the remesher must not leave. May be used by several threads at once. The field must outlive it.
class ZeroLevel {
public:
  /// \param maxStep max distance from a position to the level, cloud's unit; in coarser voxels it is larger in
  /// proportion to their side
  ZeroLevel(const DistanceField& field, float maxStep)
      : field_(field), maxStep_(maxStep), maxVoxels_(maxStep / static_cast<float>(field.lattice().spacing))
  {}

  const DistanceField& field() const { return field_; }
  float maxStep() const { return maxStep_; }

  /// Unit normal of the field, or the fallback where its gradient vanishes.
  Eigen::Vector3f normalAt(const Eigen::Vector3f& position, const Eigen::Vector3f& fallback) const;

  /// Follows the (not unit-length) gradient to the zero level: fourth-order Runge–Kutta, straight for the last quarter
  /// of a voxel. \return position and unit normal there; nothing if it is too far or the gradient vanishes
  std::optional<Corner> trace(const Eigen::Vector3f& start) const;

  /// Signed distance from the level to first order, > 0 outside; 0 where the level is too far.
  float height(const Eigen::Vector3f& position) const;

private:
  const DistanceField& field_;
  float maxStep_, maxVoxels_;
};

} // namespace pcl::mrf
