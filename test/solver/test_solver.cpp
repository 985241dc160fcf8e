// SPDX-License-Identifier: BSD-3-Clause
#include "field/prior.h"
#include "observation/observation.h"
#include "options/validation.h"
#include "support/linear_systems.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

using namespace pcl::mrf;
using namespace systems;

TEST(Solver, allMethodsGiveTheDirectSolution)
{
  Execution execution;
  for (const Energy energyKind : allEnergies)
    for (const Prior prior : allPriors)
      for (const GridSize& size : {GridSize{8, 7, 6}, GridSize{9, 1, 8}, GridSize{13, 11, 10}, GridSize{30, 1, 29}}) {
        const auto system = assemble(observeSphere(size), priorOptions(prior, energyKind, .9f));
        const auto expected = directSolution(system);
        for (const SolverMethod method : allMethods) {
          SCOPED_TRACE(testing::Message()
                       << "method " << static_cast<int>(method) << ", k = " << order(prior) << ", energy "
                       << static_cast<int>(energyKind) << ", " << size.x << " x " << size.y << " x " << size.z);
          const bool isIcm = method == SolverMethod::icm;
          if (isIcm && size.count() > 400)
            continue; // it would take ten thousands of sweeps to settle to this precision
          auto d = zeros(system);
          const SolveReport report =
              solve(system, solverOptions(method, isIcm ? 1e-9 : 1e-13, isIcm ? 100000 : 20000), 1, d, execution);
          EXPECT_TRUE(report.converged);
          EXPECT_EQ(report.method, method);
          // ICM's slowest modes still move when its step per sweep is 1e-9.
          EXPECT_LE(relativeDifference(d, expected), isIcm ? 1e-5 : 1e-8);
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
    LinearSystem system;
    system.prior = {size, prior, {}};
    std::vector<double> bent(count), scratch;
    apply(system.prior, field.data(), bent.data(), scratch, execution);
    for (std::size_t i = 0; i < count; ++i)
      targets[i] = field[i] + bent[i] / weights[i];
    observeDirectly(weights, targets, system);
    EXPECT_LE(relativeResidual(system, field, execution), 1e-13);
    std::vector<double> d(count);
    EXPECT_TRUE(solve(system, solverOptions(SolverMethod::multigrid, 1e-12), 1, d, execution).converged);
    EXPECT_LE(relativeDifference(d, field), 1e-9); // the tolerance times a condition below 12³ / 0.5
  }
}

TEST(Solver, halvesAWaveOfTheSmoothingLength)
{
  // A long bar, fully observed: cos(θ(i + ½)) is an eigenvector of L under clamped borders.
  Execution execution;
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
    const auto system = assemble(observation, options);
    auto d = zeros(system);
    solve(system, solverOptions(SolverMethod::multigrid, 1e-9, 1000), 1, d, execution);
    // The lattice's 2 − 2 cos θ differs from θ² by θ²/12 = .15 %.
    for (int i = 0; i < size.x; ++i)
      ASSERT_NEAR(d[static_cast<std::size_t>(i)], .5 * std::cos(theta * (i + .5)), .002);
  }
}

TEST(Solver, smoothingLengthScalesWithTheVoxel)
{
  const PriorOptions options = priorOptions(Prior::thinPlate);
  EXPECT_DOUBLE_EQ(smoothingLength(options, 3), 3 * smoothingLength(options, 1));
  EXPECT_NEAR(smoothingLength(options, 1), std::pow(42 * 99., -.25), 1e-4);
}

TEST(Solver, followsShiftAndScaleOfTheDistances)
{
  Execution execution;
  const GridSize size{24, 22, 20};
  for (const Energy energyKind : allEnergies)
    for (const Prior prior : allPriors) {
      const auto plain = assemble(observeSphere(size), priorOptions(prior, energyKind));
      const auto moved = assemble(observeSphere(size, 100, 1000), priorOptions(prior, energyKind));
      auto d = zeros(plain), e = zeros(moved);
      solve(plain, solverOptions(SolverMethod::multigrid, 1e-11), 1, d, execution);
      solve(moved, solverOptions(SolverMethod::multigrid, 1e-11), 1, e, execution);
      for (double& value : d)
        value = 1000 * value + 100;
      EXPECT_LE(relativeDifference(e, d), 1e-6); // the distances are stored in single precision
    }
}

TEST(Multigrid, convergesAtTheExpectedRateWhateverTheSize)
{
  Execution execution(2);
  const struct {
    Prior prior;
    int degree;
    double factor;
  } expected[] = {{Prior::membrane, 2, .3}, {Prior::thinPlate, 5, .5}, {Prior::triharmonic, 10, .8}};
  for (const auto& [prior, degree, factor] : expected)
    for (const int side : {16, 32, 64}) {
      const auto system = assemble(observeSphere({side, side, side}), priorOptions(prior));
      SolverOptions options = solverOptions(SolverMethod::multigrid, 1e-6);
      options.smootherDegree = degree;
      auto d = zeros(system);
      const SolveReport report = solve(system, options, 1, d, execution);
      ASSERT_TRUE(report.converged);
      ASSERT_EQ(static_cast<int>(report.history.size()), report.iterations);
      // From zero, so the residual was 1 before the first iteration.
      EXPECT_LT(std::pow(report.relativeResidual, 1. / report.iterations), factor)
          << "k = " << order(prior) << ", " << side;
    }
}

TEST(Multigrid, convergesForTheWeightedEnergy)
{
  Execution execution(2);
  for (const Prior prior : allPriors)
    for (const int side : {16, 33}) {
      const auto system = assemble(observeSphere({side, side, side}), priorOptions(prior, Energy::weighted));
      auto d = zeros(system);
      const SolveReport report = solve(system, solverOptions(SolverMethod::multigrid, 1e-6), 1, d, execution);
      EXPECT_TRUE(report.converged);
      EXPECT_LE(report.iterations, 60) << "k = " << order(prior); // hundreds without the coarse grids
    }
}

TEST(Multigrid, aGoodGuessSavesIterations)
{
  Execution execution;
  const auto system = assemble(observeSphere({32, 32, 32}), priorOptions(Prior::thinPlate));
  auto d = zeros(system);
  const int cold = solve(system, solverOptions(SolverMethod::multigrid, 1e-8), 1, d, execution).iterations;
  for (double& value : d)
    value *= 1.0001;
  const int warm = solve(system, solverOptions(SolverMethod::multigrid, 1e-8), 1, d, execution).iterations;
  EXPECT_LT(warm, cold);
  const SolveReport again = solve(system, solverOptions(SolverMethod::multigrid, 1e-6), 1, d, execution);
  EXPECT_EQ(again.iterations, 0);
  EXPECT_TRUE(again.converged);
}

TEST(Multigrid, tinyWeightsStayDefinite)
{
  Execution execution;
  for (const Prior prior : allPriors)
    for (const float beta : {1e-3f, 1e-6f, 1e-12f, 1e-30f}) {
      Observation observation;
      observation.lattice.size = {20, 18, 16};
      observation.voxels = {2000, 3000};
      observation.distances = {1, 1};
      observation.confidences = {1, 1};
      const auto system = assemble(observation, priorOptions(prior, Energy::joint, beta));
      auto d = zeros(system);
      // Rounding may keep it from the tolerance, but it must not fail or blow up.
      ASSERT_NO_THROW(solve(system, solverOptions(SolverMethod::multigrid), 1, d, execution)) << beta;
      EXPECT_LE(*std::max_element(d.begin(), d.end()), 2) << "k = " << order(prior) << ", beta = " << beta;
      EXPECT_GE(*std::min_element(d.begin(), d.end()), -1) << "k = " << order(prior) << ", beta = " << beta;
      if (beta >= 1e-6f) {
        d = zeros(system);
        EXPECT_TRUE(solve(system, solverOptions(SolverMethod::multigrid, 1e-6), 1, d, execution).converged);
        // Equal observations are met exactly by the constant, which the prior does not penalize.
        for (const double value : d)
          ASSERT_NEAR(value, 1, 1e-3);
      }
    }
}

TEST(Icm, everySweepLowersTheEnergy)
{
  Execution execution;
  const GridSize size{15, 14, 13};
  for (const Energy energyKind : allEnergies)
    for (const Prior prior : allPriors) {
      const auto system = assemble(observeSphere(size), priorOptions(prior, energyKind));
      auto d = oracle::randomValues(static_cast<std::size_t>(size.count()), -5, 5, 9);
      SolverOptions options = solverOptions(SolverMethod::icm, 1e-4, 40);
      options.changeTolerance = 0;
      double last = energy(system, d, execution);
      const SolveReport report = solve(system, options, 1, d, execution);
      ASSERT_EQ(report.history.size(), 40u);
      EXPECT_EQ(report.iterations, 40);
      for (const double value : report.history) {
        EXPECT_LT(value, last);
        last = value;
      }
      EXPECT_DOUBLE_EQ(last, energy(system, d, execution));
    }
}

TEST(Icm, oneSweepMinimizesOverALoneVoxel)
{
  Execution execution;
  for (const Prior prior : allPriors) {
    LinearSystem system;
    system.prior = {{1, 1, 1}, prior, {}};
    observeDirectly({2.5}, {-3}, system);
    std::vector<double> d = {40};
    solve(system, solverOptions(SolverMethod::icm, 1e-4, 1), 1, d, execution);
    EXPECT_DOUBLE_EQ(d[0], -3);
  }
}

TEST(Icm, theSeedDecidesTheVisitingOrder)
{
  Execution execution;
  const auto system = assemble(observeSphere({9, 8, 7}), priorOptions(Prior::thinPlate));
  const auto run = [&](std::uint64_t seed, int sweeps) {
    SolverOptions options = solverOptions(SolverMethod::icm, 1e-9, sweeps);
    options.seed = seed;
    auto d = zeros(system);
    solve(system, options, 1, d, execution);
    return d;
  };
  EXPECT_EQ(run(1, 3), run(1, 3));
  EXPECT_NE(run(1, 3), run(2, 3));
  EXPECT_LE(relativeDifference(run(1, 100000), run(2, 100000)), 1e-5); // both have settled
}

TEST(Icm, stopsOnTheChangeInVoxelSides)
{
  Execution execution;
  const auto plain = assemble(observeSphere({14, 13, 12}), priorOptions(Prior::membrane));
  const auto meters = assemble(observeSphere({14, 13, 12}, 0, 1024), priorOptions(Prior::membrane));
  auto d = zeros(plain), e = zeros(meters);
  const SolveReport first = solve(plain, solverOptions(SolverMethod::icm, 1e-3), 1, d, execution);
  const SolveReport second = solve(meters, solverOptions(SolverMethod::icm, 1e-3), 1024, e, execution);
  EXPECT_TRUE(first.converged);
  EXPECT_EQ(first.iterations, second.iterations);
}

TEST(Solver, refusesWhatIsNotDetermined)
{
  Execution execution;
  Observation none;
  none.lattice.size = {8, 8, 8};
  for (const SolverMethod method : allMethods) {
    const auto unobserved = assemble(none, priorOptions(Prior::membrane));
    auto d = zeros(unobserved);
    EXPECT_THROW(solve(unobserved, solverOptions(method), 1, d, execution), SolverFailure);
    const auto weightless = assemble(observeSphere({8, 8, 8}), priorOptions(Prior::membrane, Energy::joint, 0));
    EXPECT_THROW(solve(weightless, solverOptions(method), 1, d, execution), SolverFailure);

    const auto system = assemble(observeSphere({8, 8, 8}), priorOptions(Prior::thinPlate));
    if (method != SolverMethod::cholesky) { // which needs no guess
      auto bad = zeros(system);
      bad[100] = std::numeric_limits<double>::quiet_NaN();
      EXPECT_THROW(solve(system, solverOptions(method, 1e-4, 5), 1, bad, execution), SolverFailure)
          << static_cast<int>(method);
    }
  }
}

TEST(Solver, zeroDistancesGiveTheZeroField)
{
  Execution execution;
  const auto system = assemble(observeSphere({8, 8, 8}, 0, 0), priorOptions(Prior::triharmonic));
  for (const SolverMethod method : allMethods) {
    std::vector<double> d(static_cast<std::size_t>(system.size().count()), 3);
    solve(system, solverOptions(method, 1e-9, 20000), 1, d, execution);
    for (const double value : d)
      ASSERT_NEAR(value, 0, 1e-4) << static_cast<int>(method);
  }
}

TEST(Cholesky, refusesAFactorAboveTheLimit)
{
  Execution execution;
  const auto system = assemble(observeSphere({16, 16, 16}), priorOptions(Prior::triharmonic));
  auto d = zeros(system);
  SolverOptions options = solverOptions(SolverMethod::cholesky);
  options.maxFactorBytes = 3 << 20;
  try {
    solve(system, options, 1, d, execution);
    FAIL() << "accepted";
  } catch (const ResourceLimit& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("4096 unknowns"), std::string::npos) << message;
    EXPECT_NE(message.find("(3 MiB)"), std::string::npos) << message;
    EXPECT_NE(message.find("multigrid"), std::string::npos) << message;
  }
  options.maxFactorBytes = std::size_t{1} << 30;
  EXPECT_TRUE(solve(system, options, 1, d, execution).converged);
}

TEST(Cholesky, itsStructureHoldsEveryGridAndCoupling)
{
  // Grids that are cut several times, thin ones, and such that end up with separators next to each other.
  Execution execution(2);
  for (const GridSize size : {GridSize{29, 3, 17}, GridSize{1, 40, 23}, GridSize{12, 13, 14}, GridSize{200, 1, 1}})
    for (const Prior prior : allPriors)
      for (const Energy energyKind : allEnergies) {
        const auto system = assemble(observeSphere(size), priorOptions(prior, energyKind));
        auto d = zeros(system);
        solve(system, solverOptions(SolverMethod::cholesky), 1, d, execution);
        // k = 3 has a condition of some 1e9 here; the reference factor has another order.
        EXPECT_LE(relativeDifference(d, directSolution(system)), 1e-6)
            << size.x << " x " << size.y << " x " << size.z << ", k = " << order(prior);
      }
}

TEST(Cholesky, canBeLeftWithinASecond)
{
  // 24³ voxels take seconds to factorize on a slow machine; between two chances to leave lies a fraction of one.
  using Clock = std::chrono::steady_clock;
  const auto system = assemble(observeSphere({24, 24, 24}), priorOptions(Prior::triharmonic));
  Clock::time_point last = Clock::now();
  double longest = 0, fraction = 0;
  int calls = 0;
  Execution execution(1, [&](const std::string&, double done) {
    const Clock::time_point now = Clock::now();
    longest = std::max(longest, std::chrono::duration<double>(now - last).count());
    last = now;
    ++calls;
    EXPECT_GE(done, fraction);
    fraction = done;
    return done < .9;
  });
  auto d = zeros(system);
  EXPECT_THROW(solve(system, solverOptions(SolverMethod::cholesky), 1, d, execution), Cancelled);
  EXPECT_GT(calls, 400);
  EXPECT_LT(longest, 1) << "the machine is shared: a call takes some .05 s alone";
}

TEST(Solver, optionLimits)
{
  const auto refused = [](auto&& change) {
    SolverOptions options;
    change(options);
    try {
      validate(options);
    } catch (const InvalidOption& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_NO_THROW(validate(SolverOptions()));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double value : {0., 1., -1., nan})
    EXPECT_NE(refused([&](SolverOptions& o) { o.residualTolerance = value; }).find("residualTolerance"),
              std::string::npos);
  for (const double value : {-1e-3, nan, std::numeric_limits<double>::infinity()})
    EXPECT_NE(refused([&](SolverOptions& o) { o.changeTolerance = value; }).find("changeTolerance"), std::string::npos);
  EXPECT_NE(refused([](SolverOptions& o) { o.maxIterations = -1; }).find("maxIterations"), std::string::npos);
  EXPECT_NE(refused([](SolverOptions& o) { o.smootherDegree = 51; }).find("smootherDegree"), std::string::npos);
  EXPECT_NE(refused([](SolverOptions& o) { o.smootherDegree = -1; }).find("smootherDegree"), std::string::npos);
  EXPECT_NE(refused([](SolverOptions& o) { o.maxFactorBytes = 0; }).find("maxFactorBytes"), std::string::npos);
  EXPECT_NE(refused([](SolverOptions& o) { o.method = static_cast<SolverMethod>(9); }).find("method"),
            std::string::npos);
}

TEST(Solver, respectsTheNumberOfIterations)
{
  Execution execution;
  const auto system = assemble(observeSphere({16, 16, 16}), priorOptions(Prior::triharmonic));
  for (const SolverMethod method : {SolverMethod::multigrid, SolverMethod::icm, SolverMethod::cg}) {
    auto d = zeros(system);
    const SolveReport report = solve(system, solverOptions(method, 1e-9, 3), 1, d, execution);
    EXPECT_EQ(report.iterations, 3);
    EXPECT_EQ(report.history.size(), 3u);
    EXPECT_FALSE(report.converged);
    EXPECT_DOUBLE_EQ(report.relativeResidual, relativeResidual(system, d, execution));
  }
}

TEST(Solver, canBeCancelled)
{
  const auto system = assemble(observeSphere({16, 16, 16}), priorOptions(Prior::triharmonic));
  for (const SolverMethod method : allMethods) {
    double last = 0;
    Execution execution(2, [&](const std::string&, double fraction) {
      EXPECT_GE(fraction, 0);
      EXPECT_LE(fraction, 1);
      last = fraction;
      return false;
    });
    auto d = zeros(system);
    EXPECT_THROW(solve(system, solverOptions(method), 1, d, execution), Cancelled) << static_cast<int>(method);
  }
}
