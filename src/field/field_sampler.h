// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Reads of a distance field at positions that are close to each other.
#pragma once

#include <pcl/surface/mrf/distance_field.h>

#include <Eigen/Core>

#include <array>

namespace pcl::mrf {

/// Distances and gradients as the field itself gives them, bit by bit. It keeps what it has read for the cell of the
/// last position: two in three positions on the way to the zero level are in the cell of the one before, and looking up
/// the 32 voxels around it in a band costs several times as much as the interpolation.
///
/// For one thread, and as long as the field.
class FieldSampler {
public:
  explicit FieldSampler(const DistanceField& field) : field_(field) {}

  float sampleDistance(const Eigen::Vector3f& position, Eigen::Vector3f& gradient);

private:
  void enter(const DistanceField& piece, const Eigen::Array3i& cell);

  const DistanceField& field_;
  const DistanceField* piece_ = nullptr; ///< that holds the last position
  Eigen::Array3i cell_ = Eigen::Array3i::Zero();
  std::array<Eigen::Array4f, 8> corners_; ///< gradient and distance at the cell's voxels, stored x first
};

} // namespace pcl::mrf
