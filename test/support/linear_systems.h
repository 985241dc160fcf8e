// SPDX-License-Identifier: BSD-3-Clause
/// Linear systems with known solutions, and comparisons of fields, for the tests of the solvers.
#pragma once

#include "observation/observation.h"
#include "solver/grids.h"
#include "solver/linear_system.h"

#include <Eigen/SparseCore>

#include <array>
#include <cmath>
#include <random>
#include <vector>

/// The prior as an explicit matrix, by its definition, to compare the matrix-free operator with.
namespace oracle {

using Matrix = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;

/// L: Σ over the lattice's edges (i, j) of (e_i − e_j)(e_i − e_j)ᵀ.
Matrix laplacian(const pcl::mrf::GridSize& size);

/// L^k
Matrix priorMatrix(const pcl::mrf::GridSize& size, pcl::mrf::Prior prior);

/// The solution of a symmetric positive definite system, by a factorization.
Vector solved(const Matrix& matrix, const Vector& rightHandSide);

bool isPositiveDefinite(const Eigen::MatrixXd& matrix);

std::vector<double> randomValues(std::size_t count, double low, double high, unsigned seed);

} // namespace oracle

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
constexpr Energy allEnergies[] = {Energy::joint, Energy::paper};

inline PriorOptions priorOptions(Prior prior, Energy energy = Energy::joint, float beta = .99f)
{
  PriorOptions options;
  options.kind = prior;
  options.energy = energy;
  options.beta = beta;
  return options;
}

/// Distances to a sphere of radius 0.3 of the grid, within 1.5 voxels of it, without a cap of 37° around +z: a hole.
Observation observeSphere(GridSize size, double shift = 0, double scale = 1);

/// (L^k + W) d = W targets
LinearSystem observedDirectly(const GridSize& size, Prior prior, const std::vector<double>& weights,
                              const std::vector<double>& targets);

inline Eigen::Map<const oracle::Vector> asVector(const std::vector<double>& values)
{
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

std::vector<double> directSolution(const LinearSystem& system);

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
  return std::vector<double>(system.size.count());
}

inline SolverOptions solverOptions(SolverMethod method, double tolerance = 1e-4, int maxIterations = 0)
{
  SolverOptions options;
  options.method = method;
  options.residualTolerance = tolerance;
  options.changeTolerance = isIcm(method) ? tolerance : 0;
  options.maxIterations = maxIterations;
  return options;
}

/// Random points in a grid. \param beyond some are outside of its outermost voxel centers
std::vector<pcl::mrf::PointSample> randomSamples(const GridSize& size, int count, unsigned seed, bool beyond = false);

/// Uniform in 0..most, the same numbers with every standard library.
inline float uniform(std::mt19937& random, float most)
{
  return most * static_cast<float>(random()) / 4294967296.f;
}

inline Eigen::Vector3f randomDirection(std::mt19937& random)
{
  const float x = uniform(random, 2) - 1, y = uniform(random, 2) - 1, z = uniform(random, 2) - 1;
  return Eigen::Vector3f(x, y, z).normalized();
}

/// A level that is solved everywhere, with all coarser grids. It observes a sphere without a cap around +z, at points
/// of different weights or at the voxels near the sphere.
struct SphereLevel {
  std::vector<pcl::mrf::Lattice> lattices;
  pcl::mrf::LevelSamples samples;
  pcl::mrf::LevelObservation observation;
  Prior prior;
  std::vector<pcl::mrf::SolverGrid> grids;

  SphereLevel(const GridSize& size, Prior order, bool atPoints = true);
  SphereLevel(const SphereLevel&) = delete;
  SphereLevel& operator=(const SphereLevel&) = delete;

  const GridSize& size() const { return lattices.back().size; }

  LinearSystem plain() const;
};

/// All methods for plain systems.
constexpr std::array<SolverMethod, 4> allMethods = {SolverMethod::icm, SolverMethod::icmColors, SolverMethod::cg,
                                                    SolverMethod::cholesky};

} // namespace systems
