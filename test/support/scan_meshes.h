// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Triangle soups to scan.
#pragma once

#include <shapes/turns.h>

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace scan_meshes {

struct Soup {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::int32_t, 3>> triangles;

  void quad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& d)
  {
    const auto first = static_cast<std::int32_t>(vertices.size());
    vertices.insert(vertices.end(), {a, b, c, d});
    triangles.push_back({first, first + 1, first + 2});
    triangles.push_back({first, first + 2, first + 3});
  }
};

/// Sphere of longitudes and latitudes without common vertices.
inline Soup sphereSoup(double radius, int rows)
{
  Soup soup;
  const auto at = [&](int row, int column) {
    const auto polar = shapes::sinCos(.5 * row / rows), around = shapes::sinCos(.5 * column / rows);
    return Eigen::Vector3d(radius * polar.sine * around.cosine, radius * polar.sine * around.sine,
                           radius * polar.cosine);
  };
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < 2 * rows; ++column)
      soup.quad(at(row, column), at(row + 1, column), at(row + 1, column + 1), at(row, column + 1));
  return soup;
}

} // namespace scan_meshes
