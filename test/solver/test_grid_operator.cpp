// SPDX-License-Identifier: BSD-3-Clause
// The grids' operator and its V-cycle compared with explicit matrices, for all named orders of the prior and one more.
#include "field/prior.h"
#include "solver/grid_solver.h"
#include "solver/grids.h"
#include "solver/v_cycle.h"
#include "support/linear_systems.h"
#include "support/threads.h"

#include <pcl/surface/mrf/exceptions.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

using namespace pcl::mrf;
using namespace systems;

namespace {

constexpr int allOrders[] = {1, 2, 3, 4};

/// The constants of any order: the operator itself has no list of priors.
PriorConstants constantsOf(int order)
{
  return order <= 3 ? priorConstants(static_cast<Prior>(order), true) : PriorConstants{order, 10, .25, .7, .4, .25};
}

Lattice latticeOf(const GridSize& size)
{
  return {size, Eigen::Vector3d::Zero(), 1};
}

/// Voxels in runs of random lengths, anywhere in the lattice.
VoxelSet randomVoxels(const GridSize& size, unsigned seed, double share)
{
  std::mt19937 random(seed);
  return VoxelSet(withMargin(size), serial, [&](int z, MaskPlane& mask) {
    if (z < gridMargin || z >= gridMargin + size.z)
      return;
    for (int y = gridMargin; y < gridMargin + size.y; ++y)
      for (int x = gridMargin; x < gridMargin + size.x; ++x)
        if (uniform(random, 1) < static_cast<float>(share))
          mask.set(x, y);
  });
}

/// The voxels together with those of all cells that hold samples.
VoxelSet withObserved(const VoxelSet& voxels, const std::vector<PointSample>& samples)
{
  const VoxelSet observed = observedVoxels(samples, voxels.size(), serial);
  return VoxelSet(voxels.size(), serial, [&](int z, MaskPlane& mask) {
    voxels.rasterize(z, mask);
    observed.rasterize(z, mask);
  });
}

/// L of the graph of a voxel set, from its definition.
Eigen::MatrixXd graphLaplacian(const VoxelSet& voxels)
{
  const GridSize size = voxels.size();
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(voxels.count(), voxels.count());
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x)
        for (const Eigen::Array3i& step : {Eigen::Array3i(1, 0, 0), Eigen::Array3i(0, 1, 0), Eigen::Array3i(0, 0, 1)}) {
          const std::int64_t i = voxels.find(x, y, z), j = voxels.find(x + step.x(), y + step.y(), z + step.z());
          if (i < 0 || j < 0)
            continue;
          matrix(i, i) += 1;
          matrix(j, j) += 1;
          matrix(i, j) -= 1;
          matrix(j, i) -= 1;
        }
  return matrix;
}

/// L^k
Eigen::MatrixXd power(const Eigen::MatrixXd& laplacian, int k)
{
  Eigen::MatrixXd result = Eigen::MatrixXd::Identity(laplacian.rows(), laplacian.cols());
  for (; k > 0; --k)
    result = (result * laplacian).eval();
  return result;
}

/// C and b of the voxels of a set, from the plain system.
struct PlainData {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd rightHandSide;
};

PlainData plainData(const VoxelSet& voxels, const GridSize& size, const std::vector<PointSample>& samples,
                    const PointWeights& weights, double unit)
{
  const LinearSystem system = assembleAtPoints(size, Prior::membrane, samples, weights, unit, serial);
  const Eigen::MatrixXd whole = Eigen::MatrixXd(system.matrix) - Eigen::MatrixXd(oracle::laplacian(size));
  PlainData data{Eigen::MatrixXd::Zero(voxels.count(), voxels.count()), Eigen::VectorXd::Zero(voxels.count())};
  const auto indexOf = [&](std::int64_t voxel) {
    const Eigen::Array3i at = size.voxel(voxel) + gridMargin;
    return voxels.find(at.x(), at.y(), at.z());
  };
  for (std::int64_t a = 0; a < size.count(); ++a) {
    if (const std::int64_t i = indexOf(a); i >= 0) {
      data.rightHandSide[i] = system.rightHandSide[a];
      for (std::int64_t b = 0; b < size.count(); ++b)
        if (const std::int64_t j = indexOf(b); j >= 0)
          data.matrix(i, j) = whole(a, b);
    }
  }
  return data;
}

Eigen::MatrixXd matrixOf(GridOperator& system, int threads)
{
  Execution execution(threads);
  std::vector<SweepScratch> scratch(threads);
  const auto count = static_cast<Eigen::Index>(system.voxels().count());
  Eigen::MatrixXf columns(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::VectorXf unit = Eigen::VectorXf::Unit(count, i);
    system.multiply(system.voxels(), unit.data(), nullptr, columns.col(i).data(), scratch, execution);
  }
  return columns.cast<double>();
}

} // namespace

TEST(GridOperator, isThePowerOfTheLaplacianOnThinWholeLevels)
{
  const std::vector<PointSample> none;
  for (const int k : allOrders)
    for (const GridSize size : {GridSize{6, 5, 1}, GridSize{6, 5, 2}, GridSize{1, 4, 3}, GridSize{5, 1, 1}}) {
      SCOPED_TRACE(testing::Message() << "k = " << k << ", " << size.x << " x " << size.y << " x " << size.z);
      SolverGrid grid;
      grid.isWhole = true;
      grid.voxels = wholeOf(latticeOf(size), serial);
      grid.data = makePointData(none, grid.voxels, {1, 1}, 1, true);
      GridOperator system(grid, constantsOf(k), 0, serial);
      EXPECT_EQ(matrixOf(system, 1), power(graphLaplacian(grid.voxels), k)) << "whole numbers, which are exact";
    }
}

TEST(GridOperator, isTheMatrixOfItsDefinition)
{
  const GridSize size{11, 7, 6};
  const PointWeights weights{3, .7};
  for (const int k : allOrders)
    for (const double share : {1., .8, .4})
      for (const int count : {30, 3000}) { // one by one, and many in a cell
        SCOPED_TRACE(testing::Message() << "k = " << k << ", share " << share << ", " << count << " samples");
        const std::vector<PointSample> samples = sortedByCells(randomSamples(size, count, 8), serial);
        SolverGrid grid;
        grid.isWhole = share == 1;
        grid.voxels =
            grid.isWhole ? wholeOf(latticeOf(size), serial) : withObserved(randomVoxels(size, 5, share), samples);
        grid.data = makePointData(samples, grid.voxels, weights, 1.5, grid.isWhole);
        const double tautness = .3;
        GridOperator system(grid, constantsOf(k), tautness, serial);

        const PlainData data = plainData(grid.voxels, size, samples, weights, 1.5);
        const Eigen::MatrixXd laplacian = graphLaplacian(grid.voxels);
        Eigen::MatrixXd expected = power(laplacian, k);
        if (k == 1 && !grid.isWhole) // the membrane's correction in a band is zero around it
          expected.diagonal().setConstant(6);
        if (k > 1 && !grid.isWhole)
          expected += std::pow(tautness, 2 * (k - 1)) * laplacian;
        expected += data.matrix;
        // Single precision: sums of some 12^k.
        const double rounding = 1e-6 * (std::pow(12., k) + data.matrix.cwiseAbs().maxCoeff());
        const Eigen::MatrixXd matrix = matrixOf(system, 1);
        EXPECT_LT((matrix - expected).cwiseAbs().maxCoeff(), rounding);
        EXPECT_EQ(matrix, matrixOf(system, 3));

        PackedValues b;
        sumRightHandSide(grid, nullptr, b, serial);
        for (Eigen::Index i = 0; i < data.rightHandSide.size(); ++i)
          ASSERT_NEAR(b[i], data.rightHandSide[i], 1e-5 * (1 + count));
        for (std::int64_t i = 0; i < grid.voxels.count(); ++i) // a ten-thousandth of the prior's does not count
          if (const double sum = data.matrix.row(i).cwiseAbs().sum(); sum == 0 || sum > 1e-3 * std::pow(12., k)) {
            ASSERT_EQ(system.isObserved(i), sum > 0);
          }
      }
}

TEST(GridOperator, smootherIsThePolynomialOfItsDefinition)
{
  const GridSize size{9, 8, 7};
  const std::vector<PointSample> samples = sortedByCells(randomSamples(size, 40, 8), serial);
  for (const int k : allOrders) {
    SolverGrid grid;
    grid.isWhole = true;
    grid.voxels = wholeOf(latticeOf(size), serial);
    grid.data = makePointData(samples, grid.voxels, {3, .7}, 1, true);
    GridOperator system(grid, constantsOf(k), 0, serial);
    const Eigen::MatrixXd a = matrixOf(system, 1);
    const auto count = static_cast<std::size_t>(grid.voxels.count());
    // D bounds the row sums.
    std::vector<SweepScratch> scratch(1);
    std::mt19937 random(2);
    PackedValues b(count), x(count), residual(count), first(count);
    for (float& value : b)
      value = uniform(random, 2) - 1;
    Sweep sweep;
    sweep.source = Sweep::Source::zero;
    sweep.b = b.data();
    sweep.out = first.data();
    system.smooth(sweep, 1, scratch, serial);
    const auto vector = [](const PackedValues& values) -> Eigen::VectorXd {
      return Eigen::Map<const Eigen::VectorXf>(values.data(), static_cast<Eigen::Index>(values.size())).cast<double>();
    };
    const Eigen::VectorXd inverseD = vector(first).cwiseQuotient(4. / 3 * vector(b));
    for (Eigen::Index i = 0; i < a.rows(); ++i)
      EXPECT_LE(a.row(i).cwiseAbs().sum() * inverseD[i], 1.0001);

    const int degree = 6;
    Eigen::VectorXd z = vector(first), expected = z;
    for (int i = 2; i <= degree; ++i) {
      z = (2. * i - 3) / (2 * i + 1) * z + (8. * i - 4) / (2 * i + 1) * inverseD.cwiseProduct(vector(b) - a * expected);
      expected += z;
    }
    sweep.out = x.data();
    sweep.product = residual.data();
    system.smooth(sweep, degree, scratch, serial);
    EXPECT_LT((vector(x) - expected).norm(), 1e-4 * expected.norm()) << "k = " << k;
    EXPECT_LT((vector(residual) - (vector(b) - a * expected)).norm(), 1e-4 * vector(b).norm()) << "k = " << k;
  }
}

TEST(GridOperator, transfersAreAdjointAndKeepConstants)
{
  const Lattice fine = latticeOf({13, 10, 9}), coarse{{7, 5, 5}, Eigen::Vector3d::Constant(.5), 2};
  for (const double share : {1., .5}) {
    const VoxelSet fineVoxels = share == 1 ? wholeOf(fine, serial) : randomVoxels(fine.size, 1, share),
                   coarseVoxels = share == 1 ? wholeOf(coarse, serial) : randomVoxels(coarse.size, 2, share);
    const Refinement refinement(coarse, fine);
    std::mt19937 random(4);
    PackedValues f(fineVoxels.count()), c(static_cast<std::size_t>(coarseVoxels.count())), restricted(c.size());
    for (PackedValues* values : {&f, &c})
      for (float& value : *values)
        value = uniform(random, 2) - 1;
    TransferScratch scratch;
    double left = 0, right = 0;
    for (int z = 0; z < fineVoxels.size().z; ++z) {
      std::vector<float> window(fineVoxels.windowCount(), 0);
      addProlonged({coarseVoxels, c.data()}, refinement, fineVoxels, z, window.data(), scratch);
      PackedValues plane(fineVoxels.planeCount(z));
      kernels::store(fineVoxels.plane(z), window.data(), plane.data());
      for (std::size_t i = 0; i < plane.size(); ++i)
        left += static_cast<double>(plane[i]) * f[static_cast<std::size_t>(fineVoxels.planeFirst(z)) + i];
    }
    for (int z = 0; z < coarseVoxels.size().z; ++z)
      restrictPlane({fineVoxels, f.data()}, refinement, 1, coarseVoxels, z,
                    restricted.data() + coarseVoxels.planeFirst(z), scratch);
    for (std::size_t i = 0; i < c.size(); ++i)
      right += static_cast<double>(restricted[i]) * c[i];
    EXPECT_NEAR(left, right, 1e-5 * static_cast<double>(f.size()));
  }
}

TEST(VCycle, isSymmetricAndPositiveDefinite)
{
  for (const Prior prior : allPriors) {
    SphereLevel level({14, 14, 14}, prior);
    VCycle cycle(level.grids, priorConstants(prior, true), {4, 4, 8}, 1, serial);
    const auto count = static_cast<Eigen::Index>(level.grids.front().voxels.count());
    Eigen::MatrixXd m(count, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::VectorXf unit = Eigen::VectorXf::Unit(count, i);
      m.col(i) = Eigen::Map<const Eigen::VectorXf>(cycle.apply(unit.data(), serial).data(), count).cast<double>();
    }
    EXPECT_LT((m - m.transpose()).norm(), 1e-4 * m.norm()) << "k = " << order(prior);
    const Eigen::MatrixXd symmetric = .5 * (m + m.transpose());
    EXPECT_TRUE(oracle::isPositiveDefinite(symmetric)) << "k = " << order(prior);
  }
}

TEST(GridSolver, everyStepLowersTheEnergyDownToThatOfCholesky)
{
  Execution execution(2);
  for (const Prior prior : allPriors) {
    const SphereLevel level({24, 24, 24}, prior);
    const LinearSystem plain = level.plain();
    std::vector<double> exact = zeros(plain);
    const std::size_t count = exact.size();
    solve(plain, solverOptions(SolverMethod::cholesky), 1, exact, execution);
    double last = energy(plain, std::vector<double>(count, 0), execution);
    const double lowest = energy(plain, exact, execution), first = last - lowest;
    std::vector<float> d;
    for (const int steps : {1, 2, 3, 4, 6, 10, 20}) {
      d.assign(count, 0);
      SolverOptions options = solverOptions(SolverMethod::multigrid, 1e-9, steps);
      const SolveReport report = solveOnGrids({level.grids, prior, level.grids.front().voxels}, {steps, 0, 2}, options,
                                              1, d.data(), execution);
      const std::vector<double> field(d.begin(), d.end());
      const double now = energy(plain, field, execution);
      EXPECT_LT(now, last + 1e-6 * first) << "k = " << order(prior) << ", " << steps;
      last = now;
      // The residual is that of the system that was posed, not of another one.
      EXPECT_NEAR(report.relativeResidual, relativeResidual(plain, field, execution),
                  .05 * report.relativeResidual + 1e-4);
    }
    EXPECT_LT(last - lowest, 1e-4 * first) << "k = " << order(prior);
    EXPECT_LT(relativeDifference(d, exact), 2e-3) << "k = " << order(prior);
  }
}

TEST(GridSolver, tellsHowFarTheSurfaceStillIsFromItsSolution)
{
  Execution execution(2);
  for (const Prior prior : allPriors) {
    const SphereLevel level({24, 24, 24}, prior);
    const SolverGrid& finest = level.grids.front();
    const LinearSystem plain = level.plain();
    std::vector<double> exact = zeros(plain);
    solve(plain, solverOptions(SolverMethod::cholesky), 1, exact, execution);
    for (const int steps : {3, 5, 8}) {
      std::vector<float> d(exact.size()); // as far off as a coarser level's field
      std::transform(exact.begin(), exact.end(), d.begin(),
                     [](double value) { return static_cast<float>(1.1 * value + .2 * std::sin(5 * value)); });
      const SolveReport report =
          solveOnGrids({level.grids, prior, finest.voxels}, {steps, 0, 2},
                       solverOptions(SolverMethod::multigrid, 1e-9, steps), 1, d.data(), execution);
      double squares = 0, count = 0;
      for (std::size_t i = 0; i < exact.size(); ++i)
        if (std::abs(exact[i]) < 2) {
          squares += std::pow(static_cast<double>(d[i]) - exact[i], 2);
          ++count;
        }
      const double rms = std::sqrt(squares / count);
      EXPECT_FALSE(report.converged);
      // An order of magnitude is what a warning needs; measured .6 to 2.5 times.
      const double foretold = std::max(report.remainingChange, report.remainingChangeOfFillings);
      EXPECT_LT(foretold, 5 * rms + 1e-5) << "k = " << order(prior) << ", " << steps;
      EXPECT_GT(foretold, .2 * rms - 1e-5) << "k = " << order(prior) << ", " << steps;
    }
  }
}

TEST(GridSolver, convergesAtARateThatDoesNotDependOnTheGrid)
{
  Execution execution(2);
  const double limits[] = {.3, .5, .75};
  for (const Prior prior : allPriors)
    for (const int side : {16, 31, 48}) {
      const SphereLevel level({side, side, side}, prior);
      std::vector<float> d(level.grids.front().voxels.count(), 0);
      const SolveReport report = solveOnGrids({level.grids, prior, level.grids.front().voxels}, {wholeLevelSteps, 0, 2},
                                              solverOptions(SolverMethod::multigrid, 1e-3), 1, d.data(), execution);
      EXPECT_TRUE(report.converged);
      EXPECT_LT(std::pow(report.relativeResidual, 1. / report.iterations), limits[order(prior) - 1])
          << "k = " << order(prior) << ", " << side;
    }
}

TEST(GridSolver, tinyWeightsStayDefinite)
{
  for (const Prior prior : allPriors)
    for (const float beta : {1e-3f, 1e-6f, 1e-12f, 1e-30f}) {
      std::vector<Lattice> lattices = {latticeOf({20, 18, 16})};
      const std::size_t level = addCoarserGrids(lattices);
      LevelObservation observation;
      observation.prior = priorOptions(prior, Energy::joint, beta);
      observation.voxels.lattice = lattices.back();
      observation.voxels.voxels = {2000, 3000};
      observation.voxels.distances = observation.voxels.confidences = {1, 1};
      const auto grids = wholeGrids(lattices, level, observation, prior, serial);
      std::vector<float> d(lattices.back().size.count(), 0);
      // Rounding may keep it from the tolerance, but it must not fail or blow up.
      ASSERT_NO_THROW(solveWholeGrids(grids, prior, solverOptions(SolverMethod::multigrid), 1, d, serial)) << beta;
      EXPECT_LE(*std::max_element(d.begin(), d.end()), 2) << "k = " << order(prior) << ", beta = " << beta;
      EXPECT_GE(*std::min_element(d.begin(), d.end()), -1) << "k = " << order(prior) << ", beta = " << beta;
    }
}

TEST(GridSolver, aGuessThatIsNotFiniteIsRefused)
{
  const SphereLevel level({16, 16, 16}, Prior::thinPlate);
  std::vector<float> d(level.size().count(), 0);
  d[100] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(solveWholeGrids(level.grids, Prior::thinPlate, solverOptions(SolverMethod::multigrid), 1, d, serial),
               SolverFailure);
}
