// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Linear systems with known solutions, and how the tests of the solvers compare fields.
#pragma once

#include "solver/grids.h"
#include "solver/linear_system.h"
#include "support/lattice_matrix.h"

#include <Eigen/SparseCholesky>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace systems {

using pcl::mrf::Energy;
using pcl::mrf::GridSize;
using pcl::mrf::LinearSystem;
using pcl::mrf::Observation;
using pcl::mrf::Prior;
using pcl::mrf::PriorOptions;
using pcl::mrf::SolverMethod;
using pcl::mrf::SolverOptions;

constexpr Prior allPriors[] = {Prior::membrane, Prior::thinPlate, Prior::triharmonic};
constexpr Energy allEnergies[] = {Energy::joint, Energy::weighted, Energy::paperText};

inline PriorOptions priorOptions(Prior prior, Energy energy = Energy::joint, float beta = .99f)
{
  PriorOptions options;
  options.kind = prior;
  options.energy = energy;
  options.beta = beta;
  return options;
}

/// Distances to a sphere of radius 0.3 of the grid within 1.5 voxels of it, but for a cap of 37° around +z: a hole.
inline Observation observeSphere(GridSize size, double shift = 0, double scale = 1)
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

/// C = diag(weights), b = weights · targets.
inline void observeDirectly(const std::vector<double>& weights, const std::vector<double>& targets,
                            LinearSystem& system)
{
  system.data.resize(system.size().count(), system.size().count());
  system.rightHandSide.clear();
  for (std::size_t i = 0; i < weights.size(); ++i) {
    system.data.insert(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)) = weights[i];
    system.rightHandSide.push_back(weights[i] * targets[i]);
  }
  system.data.makeCompressed();
}

inline oracle::Matrix systemMatrix(const LinearSystem& system)
{
  return oracle::priorMatrix(system.prior) + oracle::Matrix(system.data);
}

inline Eigen::Map<const oracle::Vector> asVector(const std::vector<double>& values)
{
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

inline std::vector<double> directSolution(const LinearSystem& system)
{
  const Eigen::SimplicialLDLT<oracle::Matrix> factor(systemMatrix(system));
  EXPECT_EQ(factor.info(), Eigen::Success);
  const oracle::Vector solution = factor.solve(asVector(system.rightHandSide));
  return {solution.data(), solution.data() + solution.size()};
}

/// ‖a − b‖ / ‖b‖
template <typename A, typename B>
double relativeDifference(const std::vector<A>& a, const std::vector<B>& b)
{
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    difference += std::pow(static_cast<double>(a[i]) - static_cast<double>(b[i]), 2);
    norm += std::pow(static_cast<double>(b[i]), 2);
  }
  return std::sqrt(difference / norm);
}

inline std::vector<double> zeros(const LinearSystem& system)
{
  return std::vector<double>(static_cast<std::size_t>(system.size().count()));
}

inline SolverOptions solverOptions(SolverMethod method, double tolerance = 1e-4, int maxIterations = 0)
{
  SolverOptions options;
  options.method = method;
  options.residualTolerance = tolerance;
  options.changeTolerance = method == SolverMethod::icm ? tolerance : 0;
  options.maxIterations = maxIterations;
  return options;
}

/// 0..most, the same with every standard library.
inline float uniform(std::mt19937& random, float most)
{
  return most * static_cast<float>(random()) / 4294967296.f;
}

inline Eigen::Vector3f randomDirection(std::mt19937& random)
{
  const float x = uniform(random, 2) - 1, y = uniform(random, 2) - 1, z = uniform(random, 2) - 1;
  return Eigen::Vector3f(x, y, z).normalized();
}

/// A sphere, but for a cap around +z, seen by points of different weights or by the voxels near it: on a level that is
/// solved everywhere, with all grids beneath it.
struct SphereLevel {
  std::vector<pcl::mrf::Lattice> lattices;
  pcl::mrf::LevelSamples samples;
  pcl::mrf::LevelObservation observation;
  Prior prior;
  std::vector<pcl::mrf::SolverGrid> grids;

  /// \param more points beside those on the sphere
  SphereLevel(const GridSize& size, Prior order, bool atPoints = true,
              const std::vector<pcl::mrf::PointSample>& more = {})
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
  SphereLevel(const SphereLevel&) = delete;
  SphereLevel& operator=(const SphereLevel&) = delete;

  const GridSize& size() const { return lattices.back().size; }

  LinearSystem plain() const
  {
    pcl::mrf::Execution execution(1);
    return observation.samples ? assembleAtPoints(size(), prior, samples.own.back(), observation.weights, 1, execution)
                               : assemble(observation.voxels, observation.prior);
  }

  static std::vector<pcl::mrf::PointSample> pointsOnSphere(const GridSize& size)
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
};

constexpr std::array<SolverMethod, 4> allMethods = {SolverMethod::multigrid, SolverMethod::icm, SolverMethod::cg,
                                                    SolverMethod::cholesky};

} // namespace systems
