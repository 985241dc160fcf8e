/// \file
/// \brief Analytic shapes with exact signed distances: sampled clouds and fields for the tests.
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/point_set.h>

#include <functional>
#include <vector>

namespace shapes {

/// Signed distance, negative inside.
using Sdf = std::function<double(const Eigen::Vector3d&)>;

Sdf sphere(double radius, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero());
/// Torus around the z axis.
Sdf torus(double majorRadius, double minorRadius);
/// Axis-aligned box with its edges rounded by `rounding`; `half` are the outer half sides.
Sdf box(const Eigen::Vector3d& half, double rounding = 0);
/// Capsule between two points.
Sdf tube(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius);
/// Half space below the plane through the origin with the given outward normal.
Sdf plane(const Eigen::Vector3d& normal);
Sdf unite(const Sdf& a, const Sdf& b);

/// Unit outward normal by central differences.
Eigen::Vector3d normalOf(const Sdf& sdf, const Eigen::Vector3d& position);

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

} // namespace shapes
