// SPDX-License-Identifier: BSD-3-Clause
#include "field/prior.h"
#include "observation/observation.h"
#include "support/linear_systems.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

using namespace pcl::mrf;
using namespace systems;

TEST(Assemble, weightsAndTargetsOfJointAndWeightedEnergy)
{
  Observation observation;
  observation.lattice.size = {3, 2, 2};
  observation.voxels = {1, 7};
  observation.distances = {.5f, -2.f};
  observation.confidences = {1.f, .25f};
  for (const Prior prior : allPriors) {
    const double c = centerCoefficient(prior);
    const auto joint = assemble(observation, priorOptions(prior, Energy::joint, .8f));
    const auto weighted = assemble(observation, priorOptions(prior, Energy::weighted, .8f));
    EXPECT_TRUE(joint.prior.voxelWeights.empty());
    for (std::size_t i = 0; i < 12; ++i) {
      const auto v = static_cast<Eigen::Index>(i);
      const double a = i == 1 ? .8 : i == 7 ? .2 : 0;
      const double target = i == 1 ? .5 : i == 7 ? -2 : 0;
      // β = .8 is not representable in single precision.
      EXPECT_NEAR(joint.data.coeff(v, v), c * a / (1 - a), 1e-6 * c * 4);
      EXPECT_NEAR(joint.rightHandSide[i], c * a / (1 - a) * target, 1e-6 * c * 4);
      EXPECT_NEAR(weighted.data.coeff(v, v), c * a, 1e-6 * c);
      EXPECT_NEAR(weighted.rightHandSide[i], c * a * target, 1e-6 * c);
      EXPECT_NEAR(weighted.prior.voxelWeights[i], 1 - a, 1e-6);
    }
  }
  // α β = 1 would be an infinite weight.
  observation.confidences = {1.f, 1.f};
  const auto strong = assemble(observation, priorOptions(Prior::membrane, Energy::joint, std::nextafter(1.f, 0.f)));
  EXPECT_NEAR(strong.data.coeff(1, 1), 6e6, 10);
}

TEST(Assemble, weightsOfThePapersText)
{
  Observation observation;
  observation.lattice.size = {2, 2, 2};
  observation.voxels = {3};
  observation.distances = {-2.f};
  observation.confidences = {.5f};
  const std::array<double, 3> coefficients = {6, 36. / 7, 18};
  for (const Prior prior : allPriors) {
    const PriorOptions options = priorOptions(prior, Energy::paperText, .5f);
    const double expected = coefficients[static_cast<std::size_t>(order(prior) - 1)] / 3; // w of a = 1/4
    const auto system = assemble(observation, options);
    EXPECT_TRUE(system.prior.voxelWeights.empty());
    EXPECT_DOUBLE_EQ(system.data.coeff(3, 3), expected);
    EXPECT_DOUBLE_EQ(system.rightHandSide[3], -2 * expected);
    EXPECT_EQ(system.data.coeff(0, 0), 0);
    EXPECT_DOUBLE_EQ(dataCoefficient(options), 3 * expected);
    EXPECT_EQ(dataCoefficient(priorOptions(prior, Energy::joint)), centerCoefficient(prior));
    EXPECT_EQ(dataCoefficient(priorOptions(prior, Energy::weighted)), centerCoefficient(prior));
    // What the data hold back less is smoothed over a longer way, by the ratio of the weights.
    const double ratio = smoothingLength(options, 1) / smoothingLength(priorOptions(prior, Energy::joint, .5f), 1);
    EXPECT_NEAR(std::pow(ratio, 2 * order(prior)), centerCoefficient(prior) / dataCoefficient(options), 1e-9);
  }
}

// The paper's text for Eq. 6 as it stands, differentiated: what 2 w (d − d°) is added to.
TEST(Assemble, weightsOfThePapersTextFollowFromItsEnergy)
{
  // Wide enough that no clique of the voxel in the middle, nor L³ there, sees the border.
  const GridSize size{9, 9, 9};
  const std::int64_t middle = size.index(4, 4, 4);
  std::mt19937 random(1);
  std::vector<double> d(static_cast<std::size_t>(size.count()));
  for (double& value : d)
    value = std::uniform_real_distribution<double>(-1, 1)(random);
  const std::array<std::int64_t, 6> steps = {1, -1, size.x, -size.x, size.planeCount(), -size.planeCount()};
  const auto offMean = [&](std::int64_t i) { // l_i
    double sum = 0;
    for (const std::int64_t step : steps)
      sum += d[static_cast<std::size_t>(i + step)];
    return d[static_cast<std::size_t>(i)] - sum / 6;
  };
  const auto clique = [&](std::int64_t i) { // U_L(d_i)
    double sum = 0;
    for (const std::int64_t step : steps)
      sum += std::pow(offMean(i) - offMean(i + step), 2);
    return sum;
  };
  const auto allCliques = [&](std::int64_t) {
    double sum = 0;
    for (int z = 2; z < 7; ++z)
      for (int y = 2; y < 7; ++y)
        for (int x = 2; x < 7; ++x)
          sum += clique(size.index(x, y, z));
    return sum;
  };
  // Exact for a quadratic, whatever the step.
  const auto derivative = [&](const auto& energy) {
    double& value = d[static_cast<std::size_t>(middle)];
    const double before = value;
    value = before + .5;
    const double above = energy(middle);
    value = before - .5;
    const double below = energy(middle);
    value = before;
    return above - below;
  };
  Execution execution;
  const auto product = [&](Prior prior) {
    std::vector<double> result(d.size()), scratch(d.size());
    apply(PriorOperator{size, prior, {}}, d.data(), result.data(), scratch, execution);
    return result[static_cast<std::size_t>(middle)];
  };
  EXPECT_NEAR(2 * product(Prior::thinPlate) / derivative(clique),
              dataCoefficient(priorOptions(Prior::thinPlate, Energy::paperText)), 1e-9);
  EXPECT_NEAR(2 * product(Prior::triharmonic) / derivative(allCliques),
              dataCoefficient(priorOptions(Prior::triharmonic, Energy::paperText)), 1e-9);
}

TEST(Assemble, matrixFreeSystemIsTheExplicitMatrix)
{
  Execution execution;
  for (const Energy energyKind : allEnergies)
    for (const Prior prior : allPriors)
      for (const GridSize& size : {GridSize{9, 8, 7}, GridSize{10, 1, 10}, GridSize{2, 10, 9}}) {
        const auto system = assemble(observeSphere(size), priorOptions(prior, energyKind));
        const auto x = oracle::randomValues(static_cast<std::size_t>(size.count()), -1, 1, 11);
        const auto matrix = systemMatrix(system);
        const auto b = asVector(system.rightHandSide);
        const oracle::Vector product = matrix * asVector(x);
        // Rounding of a sum of a few hundred terms.
        EXPECT_NEAR(relativeResidual(system, x, execution), (b - product).norm() / b.norm(), 1e-11);
        const double expected =
            (.5 * asVector(x).dot(product) - b.dot(asVector(x))) / static_cast<double>(size.count());
        EXPECT_NEAR(energy(system, x, execution), expected, 1e-11 * std::abs(expected));
      }
}
