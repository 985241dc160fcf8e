// SPDX-License-Identifier: BSD-3-Clause
/// The surface that the remesher must not leave.
#pragma once

#include "mesh/triangle_shape.h"

#include <Eigen/Core>

#include <optional>

namespace pcl::mrf {

/// Finds the surface near a position; may be asked by several threads at once.
class ReferenceSurface {
public:
  /// \param maxStep how far from a position the surface is looked for, cloud's unit
  explicit ReferenceSurface(float maxStep) : maxStep_(maxStep) {}
  virtual ~ReferenceSurface() = default;

  float maxStep() const { return maxStep_; }

  /// Unit normal of the surface there, or the fallback where it has none.
  virtual Eigen::Vector3f normalAt(const Eigen::Vector3f& position, const Eigen::Vector3f& fallback) const = 0;

  /// Goes to the surface. \return what is reached, with its unit normal; nothing if it is too far
  virtual std::optional<Corner> trace(const Eigen::Vector3f& start) const = 0;

  /// Distance from the surface, to first order, above zero where its normals point to; zero farther than maxStep().
  virtual float height(const Eigen::Vector3f& position) const = 0;

private:
  float maxStep_;
};

} // namespace pcl::mrf
