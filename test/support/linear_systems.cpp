// SPDX-License-Identifier: BSD-3-Clause
#include "support/linear_systems.h"
#include "field/prior.h"
#include "support/shapes.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace oracle {

Matrix laplacian(const pcl::mrf::GridSize& size)
{
  const auto count = static_cast<Eigen::Index>(size.count());
  Eigen::SparseMatrix<double> differences(0, count); // one row per edge
  std::vector<Eigen::Triplet<double>> entries;
  int edges = 0;
  const int steps[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  shapes::forVoxels(size, [&](int x, int y, int z) {
    for (const auto& step : steps)
      if (size.contains(x + step[0], y + step[1], z + step[2])) {
        const auto i = static_cast<int>(size.index(x, y, z));
        const auto j = static_cast<int>(size.index(x + step[0], y + step[1], z + step[2]));
        entries.emplace_back(edges, i, 1);
        entries.emplace_back(edges, j, -1);
        ++edges;
      }
  });
  differences.resize(edges, count);
  differences.setFromTriplets(entries.begin(), entries.end());
  return Matrix(differences.transpose()) * differences;
}

Matrix priorMatrix(const pcl::mrf::GridSize& size, pcl::mrf::Prior prior)
{
  const Matrix single = laplacian(size);
  Matrix power = single;
  for (int k = 1; k < order(prior); ++k)
    power = (power * single).pruned();
  return power;
}

Vector solved(const Matrix& matrix, const Vector& rightHandSide)
{
  const Eigen::SimplicialLDLT<Matrix> factor(matrix);
  EXPECT_EQ(factor.info(), Eigen::Success);
  return factor.solve(rightHandSide);
}

bool isPositiveDefinite(const Eigen::MatrixXd& matrix)
{
  return Eigen::LLT<Eigen::MatrixXd>(matrix).info() == Eigen::Success;
}

std::vector<double> randomValues(std::size_t count, double low, double high, unsigned seed)
{
  std::mt19937 random(seed);
  std::vector<double> values(count);
  for (double& value : values)
    value = low + (high - low) * static_cast<double>(random()) / 4294967295.0;
  return values;
}

} // namespace oracle

namespace systems {

Observation observeSphere(GridSize size, double shift, double scale)
{
  Observation observation;
  observation.lattice.size = size;
  const double radius = .3 * std::max({size.x, size.y, size.z});
  shapes::forVoxels(size, [&](int x, int y, int z) {
    const Eigen::Vector3d p = Eigen::Vector3d(x, y, z) - .5 * Eigen::Vector3d(size.x - 1, size.y - 1, size.z - 1);
    const double distance = p.norm() - radius;
    if (std::abs(distance) < 1.5 && p.z() <= .8 * p.norm()) {
      observation.voxels.push_back(size.index(x, y, z));
      observation.distances.push_back(static_cast<float>(scale * distance + shift));
      observation.confidences.push_back(static_cast<float>(1 - distance * distance / 2.3));
    }
  });
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

std::vector<pcl::mrf::PointSample> randomSamples(const GridSize& size, int count, unsigned seed, bool beyond)
{
  std::mt19937 random(seed);
  const float lower = beyond ? -.5f : 0, less = beyond ? 0 : 1.01f;
  const auto along = [&](int voxels) { return lower + uniform(random, static_cast<float>(voxels) - less); };
  std::vector<pcl::mrf::PointSample> samples;
  for (int n = 0; n < count; ++n) {
    const float x = along(size.x), y = along(size.y), z = along(size.z), weight = .5f + uniform(random, 1);
    samples.emplace_back(Eigen::Vector3f(x, y, z), randomDirection(random), weight);
  }
  return samples;
}

std::vector<double> directSolution(const LinearSystem& system)
{
  const oracle::Vector solution = oracle::solved(system.matrix, asVector(system.rightHandSide));
  return {solution.data(), solution.data() + solution.size()};
}

SphereLevel::SphereLevel(const GridSize& size, Prior order, bool atPoints)
    : lattices{{size, Eigen::Vector3d::Zero(), 1}}, prior(order)
{
  pcl::mrf::Execution execution(1);
  const std::size_t level = addCoarserGrids(lattices);
  if (atPoints) {
    std::mt19937 random(3);
    const float radius = .3f * static_cast<float>(size.x), center = .5f * static_cast<float>(size.x - 1);
    std::vector<pcl::mrf::PointSample> points;
    for (int n = 0; n < 2 * size.x * size.x; ++n) {
      const Eigen::Vector3f normal = randomDirection(random);
      if (normal.z() < .5f)
        points.emplace_back(Eigen::Vector3f(radius * normal + Eigen::Vector3f::Constant(center)), normal,
                            .5f + uniform(random, 1));
    }
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

} // namespace systems
