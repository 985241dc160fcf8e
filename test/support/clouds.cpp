// SPDX-License-Identifier: BSD-3-Clause
#include "support/clouds.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

namespace clouds {

using pcl::mrf::PointSet;

std::unique_ptr<pcl::mrf::NeighborSearch> searchOf(const PointSet& points)
{
  auto search = pcl::mrf::makePointBins();
  search->setPoints(points.positions);
  return search;
}

PointSet scaled(PointSet points, float factor)
{
  for (Eigen::Vector3f& position : points.positions)
    position *= factor;
  for (Eigen::Vector3f& sensor : points.sensors)
    sensor *= factor;
  return points;
}

PointSet reordered(const PointSet& points, const std::vector<std::uint32_t>& order)
{
  PointSet result = points;
  for (std::size_t n = 0; n < order.size(); ++n) {
    result.positions[n] = points.positions[order[n]];
    if (!points.normals.empty())
      result.normals[n] = points.normals[order[n]];
    if (!points.views.empty())
      result.views[n] = points.views[order[n]];
    if (!points.origins.empty())
      result.origins[n] = points.origins[order[n]];
  }
  return result;
}

std::vector<std::uint32_t> shuffledOrder(std::size_t count, unsigned seed)
{
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  std::shuffle(order.begin(), order.end(), std::mt19937(seed));
  return order;
}

PointSet randomSquare(std::size_t count, float half, unsigned seed)
{
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> coordinate(-half, half);
  PointSet points;
  for (std::size_t i = 0; i < count; ++i) {
    const float x = coordinate(random), y = coordinate(random);
    append(points, {x, y, 0}, Eigen::Vector3f::UnitZ());
  }
  return points;
}

PointSet lattice(int side, float spacing)
{
  PointSet points;
  const float middle = .5f * static_cast<float>(side - 1);
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i)
      append(points, spacing * Eigen::Vector3f(static_cast<float>(i) - middle, static_cast<float>(j) - middle, 0),
             Eigen::Vector3f::UnitZ());
  return points;
}

namespace {

/// Where a ray first meets something, and the normal there.
struct Hit {
  double range = std::numeric_limits<double>::infinity();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();

  void offer(double other, const Eigen::Vector3d& itsNormal)
  {
    if (other > 0 && other < range) {
      range = other;
      normal = itsNormal;
    }
  }
};

void hitBox(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& ray, Hit& hit)
{
  const Eigen::Array3d toLower = (box.min() - origin).cwiseQuotient(ray),
                       toUpper = (box.max() - origin).cwiseQuotient(ray);
  int face = 0;
  const double entry = toLower.min(toUpper).maxCoeff(&face), exit = toLower.max(toUpper).minCoeff();
  if (entry < exit)
    hit.offer(entry, -Eigen::Vector3d::Unit(face) * (ray[face] > 0 ? 1 : -1));
}

} // namespace

PointSet lidar()
{
  using Eigen::AlignedBox3d;
  using Eigen::Vector3d;
  const std::vector<AlignedBox3d> boxes = {
      {Vector3d(6, 2, 0), Vector3d(8, 6, 2)},        {Vector3d(-9, -4, 0), Vector3d(-6, -2, 1.6)},
      {Vector3d(3, -8, 0), Vector3d(4, -7, 3)},      {Vector3d(-4, 9, 0), Vector3d(4, 10, 3)},
      {Vector3d(12, -3, 0), Vector3d(16, -1, 2)},    {Vector3d(25, -30, 0), Vector3d(26, 30, 6)},
      {Vector3d(-23, -30, 0), Vector3d(-22, 30, 6)}, {Vector3d(-30, 18, 0), Vector3d(30, 19, 6)},
      {Vector3d(-30, -21, 0), Vector3d(30, -20, 6)}};
  const Vector3d origin(0, 0, 1.8);
  constexpr double degree = static_cast<double>(EIGEN_PI) / 180;
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, .01);
  PointSet points;
  for (int beam = 0; beam < 32; ++beam)
    for (int step = 0; step < 1800; ++step) {
      // Off the axes, where a division by zero would wait.
      const double up = (-24.8 + 26.8 * beam / 31) * degree, around = (.2 * step + .1) * degree;
      const Vector3d ray(std::cos(up) * std::cos(around), std::cos(up) * std::sin(around), std::sin(up));
      Hit hit;
      hit.offer(-origin.z() / ray.z(), Vector3d::UnitZ());
      for (const AlignedBox3d& box : boxes)
        hitBox(box, origin, ray, hit);
      if (std::isfinite(hit.range))
        append(points, (origin + (hit.range + noise(random)) * ray).cast<float>(), hit.normal.cast<float>());
    }
  points.sensors = {origin.cast<float>()};
  return points;
}

void append(PointSet& points, const Eigen::Vector3f& position, const Eigen::Vector3f& normal)
{
  points.origins.push_back(static_cast<std::uint32_t>(points.size()));
  points.positions.push_back(position);
  points.normals.push_back(normal);
}

void append(PointSet& points, const PointSet& more)
{
  for (std::size_t i = 0; i < more.size(); ++i)
    append(points, more.positions[i], more.normals[i]);
}

pcl::mrf::Reconstruction reconstruct(const PointSet& cloud, const pcl::mrf::Options& options, int threads)
{
  pcl::mrf::Execution execution(threads);
  return pcl::mrf::reconstruct(raw(cloud.positions, cloud.normals), options, execution);
}

pcl::mrf::RawCloud raw(std::vector<Eigen::Vector3f> positions, std::vector<Eigen::Vector3f> normals)
{
  pcl::mrf::RawCloud cloud;
  cloud.positions = std::move(positions);
  cloud.normals = std::move(normals);
  return cloud;
}

} // namespace clouds
