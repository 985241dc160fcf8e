// SPDX-License-Identifier: BSD-3-Clause
/// Coordinates with more digits than single precision holds.
#pragma once

#include <Eigen/Geometry>

#include <cstddef>
#include <functional>
#include <vector>

namespace mrf_apps {

/// What to subtract from the positions before they are rounded to float: zero where that moves no point of their box by
/// more than 10⁻⁷ of its diagonal, else the center of the box (survey coordinates). It is the box that counts: between
/// points in whole meters, which float holds, there are vertices that it does not hold. The box is that of the inner
/// 98 % along each axis, so that a few strays, such as a point at zero, cost the others no digits.
/// \param position of a point, by its index; some thousand are asked for
Eigen::Vector3d floatOffset(std::size_t points, const std::function<Eigen::Vector3d(std::size_t)>& position);

inline Eigen::Vector3d floatOffset(const std::vector<Eigen::Vector3d>& positions)
{
  return floatOffset(positions.size(), [&positions](std::size_t i) { return positions[i]; });
}

/// The box of what is finite.
inline Eigen::AlignedBox3d boxOf(const std::vector<Eigen::Vector3d>& positions)
{
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& position : positions)
    if (position.allFinite())
      box.extend(position);
  return box;
}

/// Positions less an offset, rounded to float.
inline std::vector<Eigen::Vector3f> toFloat(const std::vector<Eigen::Vector3d>& positions,
                                            const Eigen::Vector3d& offset)
{
  std::vector<Eigen::Vector3f> result;
  result.reserve(positions.size());
  for (const Eigen::Vector3d& position : positions)
    result.emplace_back((position - offset).cast<float>());
  return result;
}

/// The widest step of float that shows in positions that are floats: of whole numbers none does where it is a half.
float floatRounding(const std::vector<Eigen::Vector3d>& positions);

} // namespace mrf_apps
