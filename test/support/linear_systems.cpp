// SPDX-License-Identifier: BSD-3-Clause
#include "support/linear_systems.h"
#include "observation/observation.h"

#include <algorithm>

namespace systems {

Observation observeSphere(GridSize size, double shift, double scale)
{
  Observation observation;
  observation.lattice.size = size;
  const double radius = .3 * std::max({size.x, size.y, size.z});
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) {
        const Eigen::Vector3d p = Eigen::Vector3d(x, y, z) - .5 * Eigen::Vector3d(size.x - 1, size.y - 1, size.z - 1);
        const double distance = p.norm() - radius;
        if (std::abs(distance) < 1.5 && p.z() <= .8 * p.norm()) {
          observation.voxels.push_back(size.index(x, y, z));
          observation.distances.push_back(static_cast<float>(scale * distance + shift));
          observation.confidences.push_back(static_cast<float>(1 - distance * distance / 2.3));
        }
      }
  return observation;
}

LinearSystem observedDirectly(const GridSize& size, Prior prior, const std::vector<double>& weights,
                              const std::vector<double>& targets)
{
  const oracle::Vector w = asVector(weights);
  LinearSystem system;
  system.size = size;
  system.coupling.steps = order(prior);
  system.matrix = oracle::priorMatrix(size, prior) + oracle::Matrix(w.asDiagonal());
  system.isObserved = true;
  for (std::size_t i = 0; i < weights.size(); ++i)
    system.rightHandSide.push_back(weights[i] * targets[i]);
  return system;
}

std::vector<double> directSolution(const LinearSystem& system)
{
  const oracle::Vector solution = oracle::solved(system.matrix, asVector(system.rightHandSide));
  return {solution.data(), solution.data() + solution.size()};
}

SphereLevel::SphereLevel(const GridSize& size, Prior order, bool atPoints,
                         const std::vector<pcl::mrf::PointSample>& more)
    : lattices{{size, Eigen::Vector3d::Zero(), 1}}, prior(order)
{
  pcl::mrf::Execution execution(1);
  const std::size_t level = addCoarserGrids(lattices);
  if (atPoints) {
    std::vector<pcl::mrf::PointSample> points = pointsOnSphere(size);
    points.insert(points.end(), more.begin(), more.end());
    samples = pcl::mrf::LevelSamples(sortedByCells(points, execution), lattices, execution);
    observation.samples = &samples;
    observation.weights = pcl::mrf::pointWeights(prior, .6, .5, 1, .4);
  } else {
    observation.voxels = observeSphere(size);
    observation.prior = priorOptions(prior);
  }
  grids = wholeGrids(lattices, level, observation, prior, execution);
}

LinearSystem SphereLevel::plain() const
{
  pcl::mrf::Execution execution(1);
  return observation.samples ? assembleAtPoints(size(), prior, samples.own.back(), observation.weights, 1, execution)
                             : assemble(observation.voxels, observation.prior, execution);
}

std::vector<pcl::mrf::PointSample> SphereLevel::pointsOnSphere(const GridSize& size)
{
  std::mt19937 random(3);
  const float radius = .3f * static_cast<float>(size.x), center = .5f * static_cast<float>(size.x - 1);
  std::vector<pcl::mrf::PointSample> points;
  for (int n = 0; n < 2 * size.x * size.x; ++n) {
    const Eigen::Vector3f normal = randomDirection(random);
    if (normal.z() < .5f)
      points.emplace_back(Eigen::Vector3f(radius * normal + Eigen::Vector3f::Constant(center)), normal,
                          .5f + uniform(random, 1));
  }
  return points;
}

} // namespace systems
