// Observations at the points: the block operator against its definition, merging, all solvers on it.
#include "support/linear_systems.h"
#include "support/shapes.h"

#include <pcl/surface/mrf/point_observation.h>

#include <Eigen/Eigenvalues>
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

/// Random points in the grid, some beyond its outermost voxel centres.
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
template <typename Real>
LinearSystem<Real> sphereSystem(GridSize size, Prior prior)
{
  Execution execution(2);
  const auto points = shapes::oriented(shapes::filter(shapes::sample(shapes::sphere(1), 1.2, .06),
                                                      [](const Eigen::Vector3f& p) { return p.z() < .8f; }));
  Lattice lattice;
  lattice.size = size;
  lattice.spacing = 3.2 / std::max({size.x, size.y, size.z});
  lattice.origin = -.5 * lattice.spacing * Eigen::Vector3d(size.x - 1, size.y - 1, size.z - 1);
  LinearSystem<Real> system;
  system.prior = {size, prior, {}};
  system.data = makePointDataTerm<Real>(size, toSamples(points, lattice, 1, execution),
                                        pointWeights(prior, .04, .06, lattice.spacing, .4), lattice.spacing, execution);
  return system;
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
    const auto term = makePointDataTerm<double>(size, samples, weights, unit, execution);
    const auto d = oracle::randomValues(static_cast<std::size_t>(size.count()), -1, 1, 5);
    std::vector<double> product(d.size(), 0);
    term->addProduct(d.data(), product.data(), 0, size.z);
    double quadratic = 0, linear = 0;
    for (std::size_t i = 0; i < d.size(); ++i) {
      quadratic += d[i] * product[i];
      linear += d[i] * term->rightHandSide()[i];
    }
    EXPECT_NEAR(.5 * quadratic - linear, energyOf(size, samples, weights, unit, d), 1e-9);
    // The energy is a quadratic function: central differences are its derivative but for rounding.
    for (std::size_t i = 0; i < d.size(); i += 7) {
      std::vector<double> above = d, below = d;
      above[i] += .5;
      below[i] -= .5;
      const double slope =
          energyOf(size, samples, weights, unit, above) - energyOf(size, samples, weights, unit, below);
      EXPECT_NEAR(product[i] - term->rightHandSide()[i], slope, 1e-9);
    }
  }
}

TEST(PointObservation, entriesDiagonalAndProductAgree)
{
  Execution execution(1);
  for (const GridSize size : flatGrids) {
    const auto term = makePointDataTerm<double>(size, randomSamples(size, 30, 8), {2, 1}, 1, execution);
    std::vector<Eigen::Triplet<double, std::int64_t>> entries;
    term->appendEntries(entries);
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size.count(), size.count());
    for (const auto& entry : entries)
      matrix(entry.row(), entry.col()) += entry.value();
    EXPECT_LT((matrix - matrix.transpose()).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix).eigenvalues().minCoeff(), -1e-10);
    const auto d = oracle::randomValues(static_cast<std::size_t>(size.count()), -1, 1, 5);
    std::vector<double> product(d.size(), 0);
    term->addProduct(d.data(), product.data(), 0, size.z);
    EXPECT_LT((matrix * asVector(d) - asVector(product)).norm(), 1e-10);
    EXPECT_LT((matrix.diagonal() - asVector(term->diagonal())).norm(), 1e-12);
  }
}

TEST(PointObservation, spectralBoundHolds)
{
  Execution execution(1);
  for (const int count : {1, 5, 60}) {
    const GridSize size{6, 5, 6};
    const auto term = makePointDataTerm<double>(size, randomSamples(size, count, 8), {2, .3}, 1, execution);
    std::vector<Eigen::Triplet<double, std::int64_t>> entries;
    term->appendEntries(entries);
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size.count(), size.count());
    for (const auto& entry : entries)
      matrix(entry.row(), entry.col()) += entry.value();
    Eigen::VectorXd scale = Eigen::VectorXd::Zero(size.count());
    for (Eigen::Index i = 0; i < scale.size(); ++i)
      if (matrix(i, i) > 0)
        scale[i] = 1 / std::sqrt(matrix(i, i));
    const Eigen::MatrixXd scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
    const double largest = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled).eigenvalues().maxCoeff();
    EXPECT_GE(term->spectralBound(), largest);
    EXPECT_LE(term->spectralBound(), 8);
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
    const LinearSystem<double> system = sphereSystem<double>(size, prior);
    const std::vector<double> direct = directSolution(system);
    for (const SolverMethod method : allMethods) {
      if (method == SolverMethod::icm && prior != Prior::membrane)
        continue; // ICM needs thousands of sweeps for the higher orders
      std::vector<double> d = zeros(system);
      const double tolerance = method == SolverMethod::icm ? 1e-8 : 1e-9;
      solve(system, solverOptions(method, tolerance, 20000), 1., d, execution);
      EXPECT_LT(relativeDifference(d, direct), 1e-4)
          << "method " << static_cast<int>(method) << ", order " << order(prior);
    }
  }
}

TEST(PointObservation, multigridConvergesAtARateThatDoesNotDependOnTheGrid)
{
  Execution execution(2);
  for (const Prior prior : allPriors) {
    std::vector<int> iterations;
    for (const int side : {16, 32, 48}) {
      const LinearSystem<float> system = sphereSystem<float>({side, side, side}, prior);
      std::vector<float> d = zeros(system);
      const SolveReport report = solve(system, solverOptions(SolverMethod::multigrid, 1e-3), 1., d, execution);
      EXPECT_TRUE(report.converged);
      iterations.push_back(report.iterations);
    }
    EXPECT_LE(iterations.back(), 30) << "order " << order(prior);
  }
}

TEST(PointObservation, doesNotDependOnTheNumberOfThreads)
{
  const GridSize size{30, 31, 32};
  const auto samples = randomSamples(size, 3000, 4);
  Execution one(1), four(4);
  const auto a = makePointDataTerm<float>(size, samples, {2, .3}, 1, one);
  const auto b = makePointDataTerm<float>(size, samples, {2, .3}, 1, four);
  EXPECT_EQ(a->rightHandSide(), b->rightHandSide());
  EXPECT_EQ(a->diagonal(), b->diagonal());
  EXPECT_EQ(a->spectralBound(), b->spectralBound());
  const auto coarseA = a->coarsened(Prior::triharmonic, one), coarseB = b->coarsened(Prior::triharmonic, four);
  EXPECT_EQ(coarseA->diagonal(), coarseB->diagonal());
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
