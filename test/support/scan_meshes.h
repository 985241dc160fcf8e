// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What is scanned, and how.
#pragma once

#include "scan/analytic_surface.h"
#include "scan/scan.h"

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

inline pcl::mrf::scan::AnalyticSurface shape(const std::string& description)
{
  return pcl::mrf::scan::AnalyticSurface(pcl::mrf::scan::makeShape(description));
}

inline pcl::mrf::scan::Scan scanOf(const pcl::mrf::scan::Surface& surface, const pcl::mrf::scan::ScanOptions& options,
                                   int threads = 1)
{
  pcl::mrf::Execution execution(threads);
  return simulateScan(surface, options, execution);
}

/// Of all of the surface, without sensors.
inline pcl::mrf::scan::ScanOptions unseen(std::int64_t points)
{
  pcl::mrf::scan::ScanOptions options;
  options.sampling.points = points;
  options.views.count = 0;
  return options;
}

} // namespace scan_meshes
