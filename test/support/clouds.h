// SPDX-License-Identifier: BSD-3-Clause
/// Makes and changes point sets, for tests of invariance among others.
#pragma once

#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/reconstruction.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace clouds {

/// The default search over the points of a set.
template <typename Points>
std::unique_ptr<pcl::mrf::NeighborSearch> searchOf(const Points& points)
{
  auto search = pcl::mrf::makePointBins();
  search->setPoints(points.positions);
  return search;
}

/// Positions and sensors multiplied by a factor.
pcl::mrf::PointSet scaled(pcl::mrf::PointSet points, float factor);

/// The points in the given order: point n of the result is point order[n].
pcl::mrf::PointSet reordered(const pcl::mrf::PointSet& points, const std::vector<std::uint32_t>& order);

/// A random order of `count` points.
std::vector<std::uint32_t> shuffledOrder(std::size_t count, unsigned seed = 1);

/// Points drawn at random, uniformly, from the square [-half, half]² in z = 0, with normals +z.
pcl::mrf::PointSet randomSquare(std::size_t count, float half, unsigned seed = 1);

/// Points of the unit sphere, evenly spread, without those whose z exceeds `top`: above it lies a hole.
std::vector<Eigen::Vector3d> spherePoints(std::size_t count, double top = 2);

/// side × side points of a square lattice in z = 0 with the given spacing, with normals +z.
pcl::mrf::PointSet lattice(int side, float spacing);

/// Points that a lidar of 32 beams sees in a yard, 1.8 above the ground: walls and boxes up to 25 away, one ray every
/// .2 degrees, noise of .01. Rings lie up to 50 times as far apart as their points. With true normals and sensor.
pcl::mrf::PointSet lidar();

/// Appends one point.
void append(pcl::mrf::PointSet& points, const Eigen::Vector3f& position, const Eigen::Vector3f& normal);

/// Appends all points of `more`, moved by the offset.
void append(pcl::mrf::PointSet& points, const pcl::mrf::PointSet& more,
            const Eigen::Vector3f& offset = Eigen::Vector3f::Zero());

/// A raw cloud without sensors.
pcl::mrf::RawCloud raw(std::vector<Eigen::Vector3f> positions, std::vector<Eigen::Vector3f> normals = {});

/// The reconstruction of a cloud with normals.
pcl::mrf::Reconstruction reconstruct(const pcl::mrf::PointSet& cloud, const pcl::mrf::Options& options = {},
                                     int threads = 1);

/// The message of the error of this type that the call throws; empty if it throws none.
template <typename ErrorType, typename Call>
std::string messageOf(const Call& call)
{
  try {
    call();
  } catch (const ErrorType& error) {
    return error.message();
  }
  return {};
}

} // namespace clouds
