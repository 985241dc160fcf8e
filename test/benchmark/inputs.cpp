// SPDX-License-Identifier: BSD-3-Clause
#include "inputs.h"
#include "points/sampling_density.h"
#include "support/clouds.h"
#include "support/shapes.h"

#include <cmath>

namespace benchmarks {

using Eigen::Vector3d;
using pcl::mrf::PointSet;

PointSet spherePoints(std::int64_t count)
{
  const double goldenTurn = 2 * M_PI * (1 - 2 / (1 + std::sqrt(5.0)));
  PointSet points;
  for (std::int64_t i = 0; i < count; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double turn = goldenTurn * static_cast<double>(i), radius = std::sqrt(1 - z * z);
    const Eigen::Vector3f p = Vector3d(radius * std::cos(turn), radius * std::sin(turn), z).cast<float>();
    clouds::append(points, p, p);
  }
  return clouds::reordered(points, clouds::shuffledOrder(points.size()));
}

Cloud::Cloud(std::int64_t count) : points(spherePoints(count)), search(clouds::searchOf(points))
{
  pcl::mrf::Execution execution(0);
  density = pcl::mrf::estimateSamplingDensity(points, *search, execution);
}

double sphereError(const pcl::mrf::TriangleMesh& mesh)
{
  std::vector<double> distances;
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    distances.push_back(vertex.cast<double>().norm() - 1);
  return rootMeanSquare(distances);
}

} // namespace benchmarks
