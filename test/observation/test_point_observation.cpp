// SPDX-License-Identifier: BSD-3-Clause
#include "field/prior.h"
#include "observation/observation.h"
#include "observation/point_observation.h"

// Observations at the points: the block operator against its definition, merging, all solvers on it.
#include "support/linear_systems.h"
#include "support/shapes.h"

#include <gtest/gtest.h>

#include <random>

using namespace pcl::mrf;
using namespace systems;

namespace {

PointSample sampleAt(const Eigen::Vector3f& position, const Eigen::Vector3f& normal = Eigen::Vector3f::UnitZ(),
                     float weight = 1)
{
  return {position, normal, weight};
}

/// Random points in the grid, some beyond its outermost voxel centers.
std::vector<PointSample> randomSamples(GridSize size, int count, unsigned seed)
{
  std::mt19937 random(seed);
  const auto uniform = [&] { return static_cast<float>(random()) / 4294967296.f; };
  std::vector<PointSample> samples;
  for (int n = 0; n < count; ++n) {
    const Eigen::Vector3f normal(uniform() - .5f, uniform() - .5f, uniform() - .5f);
    samples.push_back(
        sampleAt({static_cast<float>(size.x) * uniform() - .5f, static_cast<float>(size.y) * uniform() - .5f,
                  static_cast<float>(size.z) * uniform() - .5f},
                 normal.normalized(), .5f + uniform()));
  }
  return samples;
}

/// The trilinear interpolant of voxel values and its gradient, written down from their definition.
double interpolate(GridSize size, const std::vector<double>& d, const Eigen::Vector3f& at, Eigen::Vector3d& gradient)
{
  const int sizes[3] = {size.x, size.y, size.z};
  int lower[3];
  double t[3];
  for (int axis = 0; axis < 3; ++axis) {
    lower[axis] = std::max(0, std::min(static_cast<int>(std::floor(at[axis])), sizes[axis] - 2));
    t[axis] = sizes[axis] == 1 ? 0 : static_cast<double>(at[axis]) - lower[axis];
  }
  double value = 0;
  gradient.setZero();
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    Eigen::Vector3d slopes = Eigen::Vector3d::Ones();
    int voxel[3];
    for (int axis = 0; axis < 3; ++axis) {
      const int upper = corner >> axis & 1;
      voxel[axis] = std::min(lower[axis] + upper, sizes[axis] - 1);
      const double share = upper ? t[axis] : 1 - t[axis];
      weight *= share;
      for (int other = 0; other < 3; ++other)
        slopes[other] *= other == axis ? (upper ? 1. : -1.) : share;
    }
    const double x = d[static_cast<std::size_t>(size.index(voxel[0], voxel[1], voxel[2]))];
    value += weight * x;
    gradient += slopes * x;
  }
  return value;
}

/// Half the energy of the data but for a constant: Σ ρ (½ v (cᵀd)² + ½ g ‖G d − u n‖²).
double energyOf(GridSize size, const std::vector<PointSample>& samples, const PointWeights& weights, double unit,
                const std::vector<double>& d)
{
  double energy = 0;
  for (const PointSample& sample : samples) {
    Eigen::Vector3d gradient;
    const double value = interpolate(size, d, sample.position, gradient);
    energy += sample.weight * (.5 * weights.value * value * value +
                               .5 * weights.gradient * (gradient - unit * sample.normal.cast<double>()).squaredNorm() -
                               .5 * weights.gradient * unit * unit * sample.normal.cast<double>().squaredNorm());
  }
  return energy;
}

/// A cut sphere seen by its points, as a linear system.
LinearSystem sphereSystem(GridSize size, Prior prior)
{
  Execution execution(2);
  const auto points = shapes::oriented(shapes::filter(shapes::sample(shapes::sphere(1), 1.2, .06),
                                                      [](const Eigen::Vector3f& p) { return p.z() < .8f; }));
  Lattice lattice;
  lattice.size = size;
  lattice.spacing = 3.2 / std::max({size.x, size.y, size.z});
  lattice.origin = -.5 * lattice.spacing * Eigen::Vector3d(size.x - 1, size.y - 1, size.z - 1);
  return assembleAtPoints(size, prior, toSamples(points, lattice, 1, execution),
                          pointWeights(prior, .04, .06, lattice.spacing, .4), lattice.spacing, execution);
}

/// C of a system of order 1.
oracle::Matrix dataOf(const LinearSystem& system)
{
  return oracle::Matrix(system.matrix) - oracle::laplacian(system.size);
}

constexpr GridSize flatGrids[] = {{7, 6, 5}, {1, 5, 4}, {6, 1, 3}, {4, 5, 1}, {2, 2, 2}};

} // namespace

TEST(PointObservation, isTheDerivativeOfItsEnergy)
{
  Execution execution(1);
  for (const GridSize size : flatGrids) {
    const auto samples = randomSamples(size, 40, 3);
    const PointWeights weights{3, .7};
    const double unit = .25;
    const LinearSystem system = assembleAtPoints(size, Prior::membrane, samples, weights, unit, execution);
    const auto d = oracle::randomValues(static_cast<std::size_t>(size.count()), -1, 1, 5);
    const oracle::Vector product = dataOf(system) * asVector(d);
    double quadratic = 0, linear = 0;
    for (std::size_t i = 0; i < d.size(); ++i) {
      quadratic += d[i] * product[static_cast<Eigen::Index>(i)];
      linear += d[i] * system.rightHandSide[i];
    }
    EXPECT_NEAR(.5 * quadratic - linear, energyOf(size, samples, weights, unit, d), 1e-9);
    // The energy is a quadratic function: central differences are its derivative but for rounding.
    for (std::size_t i = 0; i < d.size(); i += 7) {
      std::vector<double> above = d, below = d;
      above[i] += .5;
      below[i] -= .5;
      const double slope =
          energyOf(size, samples, weights, unit, above) - energyOf(size, samples, weights, unit, below);
      EXPECT_NEAR(product[static_cast<Eigen::Index>(i)] - system.rightHandSide[i], slope, 1e-9);
    }
  }
}

TEST(PointObservation, matrixIsSymmetricAndPositive)
{
  Execution execution(1);
  for (const GridSize size : flatGrids) {
    const LinearSystem system =
        assembleAtPoints(size, Prior::membrane, randomSamples(size, 30, 8), {2, 1}, 1, execution);
    const Eigen::MatrixXd matrix = Eigen::MatrixXd(dataOf(system));
    EXPECT_LT((matrix - matrix.transpose()).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_GT(oracle::spectrumOf(matrix).values[0], -1e-10);
  }
}

TEST(PointObservation, mergingKeepsWeightsAndMeans)
{
  Execution execution(2);
  const std::vector<PointSample> samples = {sampleAt({.1f, .2f, .3f}, {1, 0, 0}, 1),
                                            sampleAt({.3f, .2f, .1f}, {0, 1, 0}, 3), sampleAt({.6f, .2f, .1f}),
                                            sampleAt({-.1f, .2f, .1f}, {0, 0, 1}, .5f)};
  const std::vector<PointSample> merged = merge(samples, .5f, execution);
  ASSERT_EQ(merged.size(), 3u);
  // In the order of the cubes.
  EXPECT_EQ(merged[0].position, samples[3].position);
  EXPECT_FLOAT_EQ(merged[1].weight, 4);
  EXPECT_LT((merged[1].position - Eigen::Vector3f(.25f, .2f, .15f)).norm(), 1e-6);
  EXPECT_LT((merged[1].normal - Eigen::Vector3f(.25f, .75f, 0)).norm(), 1e-6);
  EXPECT_EQ(merged[2].position, samples[2].position);
}

TEST(PointObservation, solversAgree)
{
  Execution execution(2);
  const GridSize size{20, 17, 19};
  for (const Prior prior : allPriors) {
    const LinearSystem system = sphereSystem(size, prior);
    const std::vector<double> direct = directSolution(system);
    for (const SolverMethod method : allMethods) {
      if (isIcm(method) && prior != Prior::membrane)
        continue; // ICM needs thousands of sweeps for the higher orders
      std::vector<double> d = zeros(system);
      const double tolerance = isIcm(method) ? 1e-8 : 1e-9;
      solve(system, solverOptions(method, tolerance, 20000), 1., d, execution);
      EXPECT_LT(relativeDifference(d, direct), 1e-4)
          << "method " << static_cast<int>(method) << ", order " << order(prior);
    }
  }
}

TEST(PointObservation, weightsBalanceThePriorAtTheSmoothingLength)
{
  // τ (h/ℓ)^(2k−1) is the number of points per voxel face, whatever the grid.
  for (const Prior prior : allPriors)
    for (const double h : {1., 2.}) {
      const PointWeights weights = pointWeights(prior, .6, 1, h, .4);
      EXPECT_NEAR(1 / weights.value * std::pow(h / .6, 2 * order(prior) - 1), h * h / 4, 1e-12);
      EXPECT_NEAR(weights.gradient / weights.value, .4 * .6 * .6 / (h * h), 1e-12);
    }
}
