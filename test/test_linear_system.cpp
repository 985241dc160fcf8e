#include "support/linear_systems.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace pcl::mrf;
using namespace systems;

TEST(Assemble, weightsAndTargetsOfBothEnergies)
{
  Observation observation;
  observation.lattice.size = {3, 2, 2};
  observation.voxels = {1, 7};
  observation.distances = {.5f, -2.f};
  observation.confidences = {1.f, .25f};
  for (const Prior prior : allPriors) {
    const double c = centreCoefficient(prior);
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
  const auto strong =
      assemble(observation, priorOptions(Prior::membrane, Energy::joint, std::nextafter(1.f, 0.f)));
  EXPECT_NEAR(strong.data.coeff(1, 1), 6e6, 10);
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
