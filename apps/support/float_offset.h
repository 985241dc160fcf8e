// SPDX-License-Identifier: BSD-3-Clause
/// Offsets for coordinates with more digits than single precision holds.
#pragma once

#include <Eigen/Geometry>

#include <cstddef>
#include <functional>
#include <vector>

namespace mrf_apps {

/// The offset to subtract from positions before they are rounded to float. It is zero if rounding moves no point of
/// their box by more than 10⁻⁷ of its diagonal, else the center of the box (survey coordinates). The whole box counts:
/// float may hold points in whole meters, but not the mesh vertices between them. The box is that of the inner 98 %
/// along each axis, so that a few strays, such as a point at zero, cost the other points no digits.
/// \param position returns the position of a point by its index; called for some thousand points
Eigen::Vector3d floatOffset(std::size_t points, const std::function<Eigen::Vector3d(std::size_t)>& position);

inline Eigen::Vector3d floatOffset(const std::vector<Eigen::Vector3d>& positions)
{
  return floatOffset(positions.size(), [&positions](std::size_t i) { return positions[i]; });
}

/// Whether floats are too coarse for a mesh through these points: a thousandth of its edges, or more. PCL's readers
/// know coordinates in float only, and take others for zero.
bool needDoubles(std::size_t points, const std::function<Eigen::Vector3d(std::size_t)>& position);

/// The bounding box of the finite positions.
inline Eigen::AlignedBox3d boxOf(const std::vector<Eigen::Vector3d>& positions)
{
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& position : positions)
    if (position.allFinite())
      box.extend(position);
  return box;
}

/// The positions minus an offset, rounded to float.
inline std::vector<Eigen::Vector3f> toFloat(const std::vector<Eigen::Vector3d>& positions,
                                            const Eigen::Vector3d& offset)
{
  std::vector<Eigen::Vector3f> result;
  result.reserve(positions.size());
  for (const Eigen::Vector3d& position : positions)
    result.emplace_back((position - offset).cast<float>());
  return result;
}

/// The largest distance between neighboring floats at those coordinates that use the last bit of a float. Whole numbers
/// do not use it where floats are half a unit apart. \pre the positions are floats
float floatRounding(const std::vector<Eigen::Vector3d>& positions);

} // namespace mrf_apps
