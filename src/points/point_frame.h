// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Where a cloud is, and how dense, as far as a sample of it tells.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace pcl {
namespace mrf {

/// Indices of about `max` of `count` values, in regular steps.
std::vector<std::size_t> sampleOf(std::size_t count, std::size_t max);

struct PointFrame {
  Eigen::Array3d center = Eigen::Array3d::Zero();
  double side = 1;
};

/// Where the bulk of the points is, and cells of about five points each: from a few thousand of them, as if the surface
/// between them were flat.
PointFrame estimateFrame(const std::vector<Eigen::Vector3f>& positions);

} // namespace mrf
} // namespace pcl
