// SPDX-License-Identifier: BSD-3-Clause
/// Points of a depth camera, with noise that neighboring pixels share.
#pragma once

#include <pcl/surface/mrf/point_set.h>

#include <functional>
#include <vector>

namespace depth_image {

constexpr int side = 160; ///< pixels

/// Noise of deviation 1 for each pixel, row by row: white noise averaged over squares with sides of 2·reach + 1 pixels.
std::vector<float> noise(int reach);

/// The plane y = 1, which recedes from 1 to 3 before a camera at the origin that looks along z. With its normals
/// towards the camera, and the sensor. \param deviation of the depth
pcl::mrf::PointSet plane(const std::function<float(float depth)>& deviation, int reach);

} // namespace depth_image
