// SPDX-License-Identifier: BSD-3-Clause
#include "field/prior.h"
#include "observation/observation.h"
#include "support/clouds.h"
#include "support/linear_systems.h"
#include "support/threads.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

using namespace pcl::mrf;
using namespace systems;

namespace {

// Odd and even sizes, and grids one or two voxels thick along one, two and all axes.
const GridSize allSizes[] = {{7, 5, 6}, {8, 4, 8}, {17, 3, 9}, {1, 6, 5}, {6, 1, 5}, {6, 5, 1}, {2, 1, 9},
                             {9, 2, 1}, {1, 1, 7}, {7, 1, 1},  {1, 7, 1}, {2, 2, 2}, {1, 1, 1}, {3, 2, 4}};

/// The system of a level without observations.
LinearSystem unobserved(const GridSize& size, Prior prior, int threads = 1)
{
  Execution execution(threads);
  return assemble({{size}, {}, {}, {}}, priorOptions(prior), execution);
}

} // namespace

TEST(Prior, isThePowerOfTheLaplacianAndKnowsItsCenter)
{
  for (const Prior prior : allPriors)
    for (const GridSize& size : allSizes) {
      SCOPED_TRACE(testing::Message() << "k = " << order(prior) << ", " << size.x << " x " << size.y << " x "
                                      << size.z);
      EXPECT_EQ(Eigen::MatrixXd(unobserved(size, prior).matrix), Eigen::MatrixXd(oracle::priorMatrix(size, prior)));
    }
  const GridSize size{9, 9, 9};
  for (const Prior prior : allPriors) {
    const std::int64_t center = size.index(4, 4, 4);
    EXPECT_EQ(unobserved(size, prior).matrix.coeff(center, center), centerCoefficient(prior));
  }
  EXPECT_EQ(centerCoefficient(Prior::membrane), 6);
  EXPECT_EQ(centerCoefficient(Prior::thinPlate), 42);
  EXPECT_EQ(centerCoefficient(Prior::triharmonic), 324);
}

TEST(Prior, sameBytesForAnyNumberOfThreads)
{
  const GridSize size{61, 47, 24}; // several pieces of work
  for (const Prior prior : allPriors) {
    sameOnAnyThreads([&](int threads) {
      const SystemMatrix m = unobserved(size, prior, threads).matrix;
      return std::make_pair(std::vector<double>(m.valuePtr(), m.valuePtr() + m.nonZeros()),
                            std::vector<std::int64_t>(m.innerIndexPtr(), m.innerIndexPtr() + m.nonZeros()));
    });
  }
}

TEST(Assemble, certaintyIsNoInfiniteWeight)
{
  const Observation observation{{{3, 2, 2}}, {1, 7}, {.5f, -2.f}, {1.f, 1.f}};
  const auto strong =
      assemble(observation, priorOptions(Prior::membrane, Energy::joint, std::nextafter(1.f, 0.f)), serial);
  EXPECT_NEAR(strong.matrix.coeff(1, 1), 6e6, 10);
}

namespace {

/// Σ (1 − a_i) U(d_i) + a_i (d_i − d°_i)² as the paper writes it.
double paperEnergy(const Observation& observation, const PriorOptions& options, const std::vector<double>& d)
{
  const GridSize size = observation.lattice.size;
  const auto sumOverNeighbors = [&](std::size_t i, const auto& term) {
    double sum = 0, count = 0;
    for (const Eigen::Array3i& step : {Eigen::Array3i(1, 0, 0), Eigen::Array3i(0, 1, 0), Eigen::Array3i(0, 0, 1)})
      for (const int side : {-1, 1}) {
        const Eigen::Array3i j = size.voxel(static_cast<std::int64_t>(i)) + side * step;
        if (size.contains(j.x(), j.y(), j.z())) {
          sum += term(static_cast<std::size_t>(size.index(j.x(), j.y(), j.z())));
          ++count;
        }
      }
    return std::make_pair(sum, count);
  };
  const bool isMembrane = options.kind == Prior::membrane;
  std::vector<double> l = d; // l_i, how far a value is off its neighbors' mean; of the membrane the value itself
  for (std::size_t i = 0; !isMembrane && i < d.size(); ++i) {
    const auto [sum, count] = sumOverNeighbors(i, [&](std::size_t j) { return d[j]; });
    l[i] -= sum / count;
  }
  std::vector<double> a(d.size(), 0), target(d.size(), 0);
  for (std::size_t n = 0; n < observation.voxels.size(); ++n) {
    const auto voxel = static_cast<std::size_t>(observation.voxels[n]);
    a[voxel] = static_cast<double>(observation.confidences[n]) * static_cast<double>(options.beta);
    target[voxel] = static_cast<double>(observation.distances[n]);
  }
  double energy = 0;
  for (std::size_t i = 0; i < d.size(); ++i) {
    const auto [clique, count] = sumOverNeighbors(i, [&](std::size_t j) { return std::pow(l[i] - l[j], 2); });
    energy += (1 - a[i]) * (isMembrane ? clique / count : clique) + a[i] * std::pow(d[i] - target[i], 2);
  }
  return energy;
}

} // namespace

TEST(Assemble, thePapersEnergyIsTheOneThatItWrites)
{
  Execution execution(2);
  for (const Prior prior : allPriors)
    for (const GridSize& size : {GridSize{6, 5, 7}, GridSize{9, 1, 4}}) {
      const Observation observation = observeSphere(size);
      const PriorOptions options = priorOptions(prior, Energy::paper, .9f);
      const LinearSystem system = assemble(observation, options, execution);
      std::vector<double> d = oracle::randomValues(static_cast<std::size_t>(size.count()), -1, 1, 5), product(d.size());
      multiply(system, d, product, execution);
      for (std::size_t i = 0; i < d.size(); ++i) {
        const double before = d[i];
        d[i] = before + .5;
        const double above = paperEnergy(observation, options, d);
        d[i] = before - .5;
        const double below = paperEnergy(observation, options, d);
        d[i] = before;
        // Central differences of a quadratic are its derivative, whatever the step.
        ASSERT_NEAR(2 * (product[i] - system.rightHandSide[i]), above - below, 1e-10) << "k = " << order(prior);
      }
    }
}

TEST(Assemble, smoothingLengthsOfThePapersEnergyAreThoseOfItsInterior)
{
  // Where all voxels are observed with a constant a, rows divided by (1 − a) are L^k times a factor, and w.
  const GridSize size{13, 13, 13};
  Observation observation;
  observation.lattice.size = size;
  for (std::int64_t i = 0; i < size.count(); ++i) {
    observation.voxels.push_back(i);
    observation.distances.push_back(0);
    observation.confidences.push_back(1);
  }
  const std::int64_t center = size.index(6, 6, 6), beside = center + 1;
  for (const Prior prior : allPriors) {
    const PriorOptions options = priorOptions(prior, Energy::paper, .75f);
    const LinearSystem system = assemble(observation, options, serial);
    const Prior power = prior == Prior::membrane ? prior : Prior::triharmonic;
    const oracle::Matrix expected = oracle::priorMatrix(size, power);
    const double factor = system.matrix.coeff(center, beside) / expected.coeff(center, beside);
    const double coefficient = .75 / factor; // w of L^k + c w
    EXPECT_NEAR(system.matrix.coeff(center, center), factor * centerCoefficient(power) + .75, 1e-9);
    EXPECT_NEAR(smoothingLength(options, 1), std::pow(coefficient, -.5 / order(power)), 1e-6);
  }
}

TEST(Solver, allMethodsGiveTheDirectSolution)
{
  for (const Energy energyKind : allEnergies)
    for (const Prior prior : allPriors)
      for (const GridSize& size : {GridSize{8, 7, 6}, GridSize{9, 1, 8}, GridSize{13, 11, 10}, GridSize{30, 1, 29}}) {
        const auto system = assemble(observeSphere(size), priorOptions(prior, energyKind, .9f), serial);
        const auto expected = directSolution(system);
        for (const SolverMethod method : allMethods) {
          SCOPED_TRACE(testing::Message()
                       << "method " << static_cast<int>(method) << ", k = " << order(prior) << ", energy "
                       << static_cast<int>(energyKind) << ", " << size.x << " x " << size.y << " x " << size.z);
          const bool visits = isIcm(method);
          if (visits && size.count() > 400)
            continue; // it would take ten thousands of sweeps to settle to this precision
          auto d = zeros(system);
          const SolveReport report =
              solve(system, solverOptions(method, visits ? 1e-9 : 1e-13, visits ? 100000 : 20000), 1, d, serial);
          EXPECT_TRUE(report.converged);
          EXPECT_EQ(report.method, method);
          // ICM's slowest modes still move when its step per sweep is 1e-9.
          EXPECT_LE(relativeDifference(d, expected), visits ? 1e-5 : 1e-8);
        }
      }
}

TEST(Solver, manufacturedSolution)
{
  Execution execution(2);
  for (const Prior prior : allPriors) {
    const GridSize size{33, 32, 31};
    const auto count = static_cast<std::size_t>(size.count());
    const auto weights = oracle::randomValues(count, .5, 50, 21);
    // Any field, and the targets that make it the solution: P x + w (x − t) = 0.
    std::vector<double> field(count), targets(count);
    for (std::size_t i = 0; i < count; ++i) {
      const auto at = static_cast<double>(i);
      field[i] = std::sin(.3 * at) + std::cos(.01 * at);
    }
    const oracle::Vector bent = oracle::priorMatrix(size, prior) * asVector(field);
    for (std::size_t i = 0; i < count; ++i)
      targets[i] = field[i] + bent[static_cast<Eigen::Index>(i)] / weights[i];
    const LinearSystem system = observedDirectly(size, prior, weights, targets);
    EXPECT_LE(relativeResidual(system, field, execution), 1e-13);
    std::vector<double> d(count);
    EXPECT_TRUE(solve(system, solverOptions(SolverMethod::cg, 1e-12), 1, d, execution).converged);
    EXPECT_LE(relativeDifference(d, field), 1e-9); // the tolerance times a condition below 12³ / 0.5
  }
}

TEST(Solver, halvesAWaveOfTheSmoothingLength)
{
  // A long bar, fully observed: cos(θ(i + ½)) is an eigenvector of L under clamped borders.
  const GridSize size{240, 1, 1};
  for (const Prior prior : allPriors) {
    const int k = order(prior);
    const double theta = M_PI * 10 / size.x; // wavelength 48 voxels
    // c_k w = θ^(2k), so that the smoothing length is 1/θ voxels.
    const double w = std::pow(theta, 2 * k) / centerCoefficient(prior);
    const PriorOptions options = priorOptions(prior, Energy::joint, static_cast<float>(w / (1 + w)));
    EXPECT_NEAR(smoothingLength(options, .5), .5 / theta, 1e-5);
    Observation observation;
    observation.lattice.size = size;
    for (int i = 0; i < size.x; ++i) {
      observation.voxels.push_back(i);
      observation.distances.push_back(static_cast<float>(std::cos(theta * (i + .5))));
      observation.confidences.push_back(1);
    }
    const auto system = assemble(observation, options, serial);
    auto d = zeros(system);
    solve(system, solverOptions(SolverMethod::cholesky), 1, d, serial);
    // The lattice's 2 − 2 cos θ differs from θ² by θ²/12 = .15 %.
    for (int i = 0; i < size.x; ++i)
      ASSERT_NEAR(d[i], .5 * std::cos(theta * (i + .5)), .002);
  }
}

TEST(Solver, conjugateGradientsStandInForMultigrid)
{
  const auto system = assemble(observeSphere({12, 12, 12}), priorOptions(Prior::thinPlate, Energy::paper), serial);
  auto d = zeros(system);
  const SolveReport report = solve(system, solverOptions(SolverMethod::multigrid, 1e-8), 1, d, serial);
  EXPECT_EQ(report.method, SolverMethod::cg);
  EXPECT_TRUE(report.converged);
}

TEST(Icm, everySweepLowersTheEnergy)
{
  const GridSize size{15, 14, 13};
  for (const Energy energyKind : allEnergies)
    for (const Prior prior : allPriors) {
      const auto system = assemble(observeSphere(size), priorOptions(prior, energyKind), serial);
      auto d = oracle::randomValues(static_cast<std::size_t>(size.count()), -5, 5, 9);
      const SolverMethod method = prior == Prior::thinPlate ? SolverMethod::icmColors : SolverMethod::icm;
      SolverOptions options = solverOptions(method, 1e-4, 40);
      options.changeTolerance = 0;
      double last = energy(system, d, serial);
      const SolveReport report = solve(system, options, 1, d, serial);
      ASSERT_EQ(report.history.size(), 40u);
      EXPECT_EQ(report.iterations, 40);
      for (const double value : report.history) {
        EXPECT_LT(value, last);
        last = value;
      }
      EXPECT_DOUBLE_EQ(last, energy(system, d, serial));
    }
}

TEST(Icm, theSeedDecidesTheVisitingOrder)
{
  const auto system = assemble(observeSphere({9, 8, 7}), priorOptions(Prior::thinPlate), serial);
  for (const SolverMethod method : {SolverMethod::icm, SolverMethod::icmColors}) {
    const auto run = [&](std::uint64_t seed, int sweeps) {
      SolverOptions options = solverOptions(method, 1e-9, sweeps);
      options.seed = seed;
      auto d = zeros(system);
      solve(system, options, 1, d, serial);
      return d;
    };
    EXPECT_EQ(run(1, 3), run(1, 3));
    EXPECT_NE(run(1, 3), run(2, 3));
    EXPECT_LE(relativeDifference(run(1, 100000), run(2, 100000)), 1e-5); // both have settled
  }
}

TEST(Icm, aSweepVisitsEveryVoxelOnce)
{
  // Without a prior's coupling a sweep is the solution, in any order; a voxel left out would keep its guess.
  const GridSize size{30, 20, 10};
  const auto count = static_cast<std::size_t>(size.count());
  const auto targets = oracle::randomValues(count, -1, 1, 4);
  LinearSystem system = observedDirectly(size, Prior::membrane, std::vector<double>(count, 2), targets);
  system.matrix = SystemMatrix(oracle::Matrix(oracle::Vector::Constant(size.count(), 2).asDiagonal()));
  for (const SolverMethod method : {SolverMethod::icm, SolverMethod::icmColors}) {
    std::vector<double> d(count, 7);
    solve(system, solverOptions(method, 1e-9, 1), 1, d, serial);
    EXPECT_LE(relativeDifference(d, targets), 1e-12);
  }
}

TEST(Icm, stopsOnTheChangeInVoxelSides)
{
  const auto plain = assemble(observeSphere({14, 13, 12}), priorOptions(Prior::membrane), serial);
  const auto meters = assemble(observeSphere({14, 13, 12}, 0, 1024), priorOptions(Prior::membrane), serial);
  auto d = zeros(plain), e = zeros(meters);
  const SolveReport first = solve(plain, solverOptions(SolverMethod::icm, 1e-3), 1, d, serial);
  const SolveReport second = solve(meters, solverOptions(SolverMethod::icm, 1e-3), 1024, e, serial);
  EXPECT_TRUE(first.converged);
  EXPECT_EQ(first.iterations, second.iterations);
}

TEST(Solver, refusesWhatIsNotDetermined)
{
  for (const SolverMethod method : allMethods) {
    const auto empty = unobserved({8, 8, 8}, Prior::membrane);
    auto d = zeros(empty);
    EXPECT_THROW(solve(empty, solverOptions(method), 1, d, serial), SolverFailure);
    const auto weightless = assemble(observeSphere({8, 8, 8}), priorOptions(Prior::membrane, Energy::joint, 0), serial);
    EXPECT_THROW(solve(weightless, solverOptions(method), 1, d, serial), SolverFailure);

    const auto system = assemble(observeSphere({8, 8, 8}), priorOptions(Prior::thinPlate), serial);
    if (method != SolverMethod::cholesky) { // which needs no guess
      auto bad = zeros(system);
      bad[100] = std::numeric_limits<double>::quiet_NaN();
      EXPECT_THROW(solve(system, solverOptions(method, 1e-4, 5), 1, bad, serial), SolverFailure)
          << static_cast<int>(method);
    }
  }
}

TEST(Solver, zeroDistancesGiveTheZeroField)
{
  const auto system = assemble(observeSphere({8, 8, 8}, 0, 0), priorOptions(Prior::triharmonic), serial);
  for (const SolverMethod method : allMethods) {
    std::vector<double> d(system.size.count(), 3);
    solve(system, solverOptions(method, 1e-9, 20000), 1, d, serial);
    for (const double value : d)
      ASSERT_NEAR(value, 0, 1e-4) << static_cast<int>(method);
  }
}

TEST(Cholesky, refusesWhatTakesTooLongOrIsNotPositiveDefinite)
{
  const auto system = assemble(observeSphere({80, 80, 80}), priorOptions(Prior::membrane), serial);
  auto d = zeros(system);
  const std::string message =
      clouds::messageOf<ResourceLimit>([&] { solve(system, solverOptions(SolverMethod::cholesky), 1, d, serial); });
  for (const char* words : {"512000 unknowns", " s, in which the run could not be cancelled", "multigrid"})
    EXPECT_NE(message.find(words), std::string::npos) << message;

  auto indefinite = assemble(observeSphere({8, 8, 8}), priorOptions(Prior::membrane), serial);
  d = zeros(indefinite);
  indefinite.matrix.coeffRef(100, 100) = -1;
  EXPECT_THROW(solve(indefinite, solverOptions(SolverMethod::cholesky), 1, d, serial), SolverFailure);
}

TEST(Cholesky, theOrderOfEliminationSuitsEveryGridAndCoupling)
{
  // Grids that are cut several times, thin ones, and such that end up with separators next to each other.
  Execution execution(2);
  for (const GridSize size : {GridSize{29, 3, 17}, GridSize{1, 40, 23}, GridSize{12, 13, 14}, GridSize{200, 1, 1}})
    for (const Prior prior : allPriors)
      for (const Energy energyKind : allEnergies) {
        const auto system = assemble(observeSphere(size), priorOptions(prior, energyKind), execution);
        std::vector<std::int64_t> order = dissectionOrder(size, system.coupling);
        auto d = zeros(system);
        solve(system, solverOptions(SolverMethod::cholesky), 1, d, execution);
        // k = 3 has a condition of some 1e9 here; the reference factor has another order.
        EXPECT_LE(relativeDifference(d, directSolution(system)), 1e-6)
            << size.x << " x " << size.y << " x " << size.z << ", k = " << pcl::mrf::order(prior);
        std::sort(order.begin(), order.end());
        for (std::int64_t i = 0; i < size.count(); ++i)
          ASSERT_EQ(order[i], i);
      }
}

TEST(Solver, stopsAfterTheIterationsAndWhenItIsCancelled)
{
  const auto system = assemble(observeSphere({16, 16, 16}), priorOptions(Prior::triharmonic), serial);
  for (const SolverMethod method : {SolverMethod::icmColors, SolverMethod::icm, SolverMethod::cg}) {
    auto d = zeros(system);
    const SolveReport report = solve(system, solverOptions(method, 1e-9, 3), 1, d, serial);
    EXPECT_EQ(report.iterations, 3);
    EXPECT_EQ(report.history.size(), 3u);
    EXPECT_FALSE(report.converged);
    EXPECT_DOUBLE_EQ(report.relativeResidual, relativeResidual(system, d, serial));
  }
  for (const SolverMethod method : allMethods) {
    Execution cancelling(2, [&](const std::string&, double fraction) {
      EXPECT_GE(fraction, 0);
      EXPECT_LE(fraction, 1);
      return false;
    });
    auto d = zeros(system);
    EXPECT_THROW(solve(system, solverOptions(method), 1, d, cancelling), Cancelled) << static_cast<int>(method);
  }
}

TEST(Solver, sameBytesForAnyNumberOfThreads)
{
  const GridSize size{53, 47, 44}; // above the size that is cut into slabs
  for (const Prior prior : {Prior::membrane, Prior::triharmonic}) {
    Execution several(2);
    const auto system = assemble(observeSphere(size), priorOptions(prior, Energy::joint), several);
    for (const SolverMethod method : {SolverMethod::cg, SolverMethod::icmColors, SolverMethod::icm}) {
      const SolverOptions options = solverOptions(method, 1e-9, isIcm(method) ? 1 : 2);
      const auto solved = [&](int threads) {
        Execution execution(threads);
        auto d = zeros(system);
        const SolveReport report = solve(system, options, 1, d, execution);
        return std::make_pair(d, report.history);
      };
      EXPECT_EQ(sameOnAnyThreads(solved), solved(11)) << "slabs thinner than the smoother's reach";
    }
  }
}
