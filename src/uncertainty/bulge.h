// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What flat triangles cut off of a curved surface.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>

namespace pcl {
namespace mrf {

/// Mean height over a triangle of the paraboloid through its corners that is perpendicular to the normals there: amid
/// an edge it is as high as the arc whose ends have these normals, and a third of the area stands for each edge.
inline double meanBulge(const std::array<Eigen::Vector3d, 3>& corners, const std::array<Eigen::Vector3d, 3>& normals)
{
  double heights = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::size_t next = (c + 1) % 3;
    heights += (corners[next] - corners[c]).dot(normals[next] - normals[c]) / 8;
  }
  return heights / 3;
}

} // namespace mrf
} // namespace pcl
