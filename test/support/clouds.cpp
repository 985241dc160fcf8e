// SPDX-License-Identifier: BSD-3-Clause
#include "support/clouds.h"

#include <shapes/signed_distance.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace clouds {

using pcl::mrf::PointSet;

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

std::vector<Eigen::Vector3d> spherePoints(std::size_t count, double top)
{
  const double goldenAngle = M_PI * (3 - std::sqrt(5.));
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    const auto number = static_cast<double>(i);
    const double z = 1 - (2 * number + 1) / static_cast<double>(count), radius = std::sqrt(1 - z * z);
    if (z <= top)
      points.emplace_back(radius * std::cos(goldenAngle * number), radius * std::sin(goldenAngle * number), z);
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

PointSet lidar()
{
  using Eigen::Vector3d;
  using Corners = std::pair<Vector3d, Vector3d>;
  std::vector<shapes::Sdf> yard = {shapes::plane(Vector3d::UnitZ())};
  for (const auto& [lower, upper] :
       {Corners({6, 2, 0}, {8, 6, 2}), Corners({-9, -4, 0}, {-6, -2, 1.6}), Corners({3, -8, 0}, {4, -7, 3}),
        Corners({-4, 9, 0}, {4, 10, 3}), Corners({12, -3, 0}, {16, -1, 2}), Corners({25, -30, 0}, {26, 30, 6}),
        Corners({-23, -30, 0}, {-22, 30, 6}), Corners({-30, 18, 0}, {30, 19, 6}), Corners({-30, -21, 0}, {30, -20, 6})})
    yard.push_back(shapes::translate(shapes::box((upper - lower) / 2), (lower + upper) / 2));
  const shapes::Sdf distance = shapes::unite(yard);
  const Vector3d origin(0, 0, 1.8);
  constexpr double degree = static_cast<double>(EIGEN_PI) / 180;
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, .01);
  PointSet points;
  for (int beam = 0; beam < 32; ++beam)
    for (int step = 0; step < 1800; ++step) {
      const double up = (-24.8 + 26.8 * beam / 31) * degree, around = .2 * step * degree;
      const Vector3d ray(std::cos(up) * std::cos(around), std::cos(up) * std::sin(around), std::sin(up));
      double range = 0;
      for (double left = 1; left > 1e-6 && range < 50; range += left)
        left = distance(origin + range * ray);
      if (range < 50)
        append(points, (origin + (range + noise(random)) * ray).cast<float>(),
               shapes::normalOf(distance, origin + range * ray).cast<float>());
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

void append(PointSet& points, const PointSet& more, const Eigen::Vector3f& offset)
{
  for (std::size_t i = 0; i < more.size(); ++i)
    append(points, Eigen::Vector3f(more.positions[i] + offset), more.normals[i]);
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
