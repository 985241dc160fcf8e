// SPDX-License-Identifier: BSD-3-Clause
/// Sampled clouds and fields of analytic shapes, for the tests.
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/point_set.h>

#include <shapes/signed_distance.h>

#include <cmath>
#include <functional>
#include <vector>

namespace shapes {

/// About evenly spaced points on the zero level with exact normals, inside the box [-halfSide, halfSide]³.
///
/// One random point per surface voxel of side `spacing`, projected on the surface, then thinned so that no two are
/// closer than 0.7 spacing: mean nearest distance close to `spacing`. `origins` are 0..n-1.
pcl::mrf::PointSet sample(const Sdf& sdf, double halfSide, double spacing, unsigned seed = 1);

/// Keeps the points for which `inside` is true.
pcl::mrf::PointSet filter(const pcl::mrf::PointSet& points,
                          const std::function<bool(const Eigen::Vector3f& position)>& inside);

/// Adds Gaussian noise of the given standard deviation along the normals.
void addNoise(pcl::mrf::PointSet& points, double sigma, unsigned seed = 1);

/// The points with their normals, as the observation stage wants them.
pcl::mrf::OrientedPoints oriented(const pcl::mrf::PointSet& points);

/// The exact field on a lattice of cubic shape [-halfSide, halfSide]³ with the given number of voxels along each axis;
/// confidence 1 everywhere.
pcl::mrf::DistanceField field(const Sdf& sdf, double halfSide, int voxels);

/// Calls body(x, y, z) for all voxels of a grid, in the order of memory.
template <typename Body>
void forVoxels(const pcl::mrf::GridSize& size, const Body& body)
{
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x)
        body(x, y, z);
}

} // namespace shapes

/// Root of the mean of the squares; 0 for no values.
inline double rootMeanSquare(const std::vector<double>& values)
{
  double sum = 0;
  for (const double value : values)
    sum += value * value;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}
