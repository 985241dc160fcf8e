// SPDX-License-Identifier: BSD-3-Clause
#include "support/depth_image.h"

#include <random>

namespace depth_image {

std::vector<float> noise(int reach)
{
  std::mt19937 random(7);
  std::normal_distribution<float> gaussian;
  std::vector<float> white(side * side), image(side * side, 0);
  for (float& value : white)
    value = gaussian(random);
  for (int v = 0; v < side; ++v)
    for (int u = 0; u < side; ++u)
      for (int y = v - reach; y <= v + reach; ++y)
        for (int x = u - reach; x <= u + reach; ++x)
          image[v * side + u] +=
              white[(y + side) % side * side + (x + side) % side] / static_cast<float>(2 * reach + 1);
  return image;
}

pcl::mrf::PointSet plane(const std::function<float(float depth)>& deviation, int reach)
{
  const std::vector<float> errors = noise(reach);
  pcl::mrf::PointSet points;
  for (int v = 0; v < side; ++v)
    for (int u = 0; u < side; ++u) {
      const float y = 1 - 2.f / 3 * static_cast<float>(v) / side, x = static_cast<float>(u) / side - .5f;
      const float depth = 1 / y;
      const float measured = depth + deviation(depth) * errors[v * side + u];
      points.positions.push_back(measured * Eigen::Vector3f(x, y, 1));
    }
  points.normals.assign(points.size(), -Eigen::Vector3f::UnitY());
  points.sensors = {Eigen::Vector3f::Zero()};
  return points;
}

} // namespace depth_image
