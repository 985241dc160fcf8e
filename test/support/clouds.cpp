#include "support/clouds.h"

#include <algorithm>
#include <numeric>
#include <random>

namespace clouds {

using pcl::mrf::PointSet;

std::unique_ptr<pcl::mrf::NeighbourSearch> searchOf(const PointSet& points)
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

} // namespace clouds
