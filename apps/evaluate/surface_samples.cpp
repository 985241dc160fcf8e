// SPDX-License-Identifier: BSD-3-Clause
#include "surface_samples.h"

#include <pcl/surface/mrf/exceptions.h>

#include <Eigen/Geometry>

#include <cmath>
#include <random>

namespace mrf_apps {
namespace {

/// In [0, 1), the same on every platform, as the standard's distributions are not.
double uniform(std::mt19937_64& generator)
{
  return static_cast<double>(generator() >> 11) * 0x1p-53;
}

} // namespace

Eigen::Vector3d areaVector(const SurfaceMesh& mesh, std::size_t triangle)
{
  const auto corner = [&](std::size_t i) -> const Eigen::Vector3d& {
    return mesh.vertices[mesh.triangles[triangle][i]];
  };
  const Eigen::Vector3d result = .5 * (corner(1) - corner(0)).cross(corner(2) - corner(0));
  return result.allFinite() ? result : Eigen::Vector3d::Zero();
}

bool hasArea(const SurfaceMesh& mesh)
{
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!areaVector(mesh, t).isZero(0))
      return true;
  return false;
}

double surfaceArea(const SurfaceMesh& mesh)
{
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    area += areaVector(mesh, t).norm();
  return area;
}

SurfaceSamples sampleSurface(const SurfaceMesh& mesh, std::int64_t count, std::uint64_t seed)
{
  const double total = surfaceArea(mesh);
  if (!(total > 0))
    throw pcl::mrf::InvalidInput("the mesh has no triangle with an area");

  SurfaceSamples samples;
  samples.positions.reserve(static_cast<std::size_t>(count));
  samples.triangles.reserve(static_cast<std::size_t>(count));
  std::mt19937_64 generator(seed);
  std::size_t current = 0, lastWithArea = 0;
  double before = 0; // area of the triangles ahead of the current one
  for (std::int64_t i = 0; i < count; ++i) {
    const double target = total * (static_cast<double>(i) + uniform(generator)) / static_cast<double>(count);
    for (; current < mesh.triangles.size(); ++current) {
      const double area = areaVector(mesh, current).norm();
      if (area > 0)
        lastWithArea = current;
      if (target < before + area)
        break;
      before += area;
    }
    const auto& triangle = mesh.triangles[lastWithArea];
    // The square root makes the density uniform: the part of a triangle beyond a line parallel to a side is quadratic.
    const double r = std::sqrt(uniform(generator)), s = uniform(generator);
    samples.positions.push_back((1 - r) * mesh.vertices[triangle[0]] + r * (1 - s) * mesh.vertices[triangle[1]] +
                                r * s * mesh.vertices[triangle[2]]);
    samples.triangles.push_back(static_cast<std::int32_t>(lastWithArea));
  }
  return samples;
}

} // namespace mrf_apps
