// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What a depth camera sees, with noise that neighboring pixels share.
#pragma once

#include <pcl/surface/mrf/point_set.h>

#include <functional>
#include <vector>

namespace depth_image {

constexpr int side = 160; ///< pixels

/// Noise of deviation 1 of each pixel, row by row, the same over some squares of 2·reach + 1 pixels in the mean.
std::vector<float> noise(int reach);

/// The plane y = 1, which recedes from 1 to 3 before a camera at the origin that looks along z. With its normals
/// towards the camera, and the sensor. \param deviation of the depth
pcl::mrf::PointSet plane(const std::function<float(float depth)>& deviation, int reach);

} // namespace depth_image
