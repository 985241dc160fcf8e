// SPDX-License-Identifier: BSD-3-Clause
#include "inputs.h"
#include "points/sampling_density.h"
#include "support/clouds.h"
#include "support/shapes.h"

namespace benchmarks {

using pcl::mrf::PointSet;

PointSet spherePoints(std::int64_t count)
{
  PointSet points;
  for (const Eigen::Vector3d& p : clouds::spherePoints(static_cast<std::size_t>(count)))
    clouds::append(points, p.cast<float>(), p.cast<float>());
  return clouds::reordered(points, clouds::shuffledOrder(points.size()));
}

Cloud::Cloud(std::int64_t count) : points(spherePoints(count)), search(clouds::searchOf(points))
{
  pcl::mrf::Execution execution(0);
  density = pcl::mrf::estimateSamplingDensity(points, measureNeighbors(points, *search, execution), execution);
}

double sphereError(const pcl::mrf::TriangleMesh& mesh)
{
  std::vector<double> distances;
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    distances.push_back(vertex.cast<double>().norm() - 1);
  return rootMeanSquare(distances);
}

} // namespace benchmarks
