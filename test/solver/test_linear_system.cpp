// SPDX-License-Identifier: BSD-3-Clause
#include "field/prior.h"
#include "observation/observation.h"
#include "support/linear_systems.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace pcl::mrf;
using namespace systems;

namespace {

// Odd, even, and one or two voxels thick along one, two and all axes.
const GridSize allSizes[] = {{7, 5, 6}, {8, 4, 8}, {17, 3, 9}, {1, 6, 5}, {6, 1, 5}, {6, 5, 1}, {2, 1, 9},
                             {9, 2, 1}, {1, 1, 7}, {7, 1, 1},  {1, 7, 1}, {2, 2, 2}, {1, 1, 1}, {3, 2, 4}};

/// The matrix of a level that nothing observes.
LinearSystem unobserved(const GridSize& size, Prior prior, int threads = 1)
{
  Execution execution(threads);
  Observation none;
  none.lattice.size = size;
  PriorOptions options;
  options.kind = prior;
  return assemble(none, options, execution);
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
  const GridSize size{61, 47, 43}; // several pieces of work
  for (const Prior prior : allPriors) {
    const SystemMatrix one = unobserved(size, prior).matrix;
    for (const int threads : {2, 3}) {
      const SystemMatrix other = unobserved(size, prior, threads).matrix;
      ASSERT_EQ(one.nonZeros(), other.nonZeros());
      EXPECT_TRUE(std::equal(one.valuePtr(), one.valuePtr() + one.nonZeros(), other.valuePtr()));
      EXPECT_TRUE(std::equal(one.innerIndexPtr(), one.innerIndexPtr() + one.nonZeros(), other.innerIndexPtr()));
    }
  }
}

TEST(Assemble, weightsAndTargets)
{
  Execution execution;
  Observation observation;
  observation.lattice.size = {3, 2, 2};
  observation.voxels = {1, 7};
  observation.distances = {.5f, -2.f};
  observation.confidences = {1.f, .25f};
  for (const Prior prior : allPriors) {
    const double c = centerCoefficient(prior);
    const auto joint = assemble(observation, priorOptions(prior, Energy::joint, .8f), execution);
    const Eigen::MatrixXd data =
        Eigen::MatrixXd(joint.matrix) - Eigen::MatrixXd(oracle::priorMatrix(joint.size, prior));
    EXPECT_TRUE(joint.isObserved);
    for (std::size_t i = 0; i < 12; ++i) {
      const auto v = static_cast<Eigen::Index>(i);
      const double a = i == 1 ? .8 : i == 7 ? .2 : 0;
      const double target = i == 1 ? .5 : i == 7 ? -2 : 0;
      // β = .8 is not representable in single precision.
      EXPECT_NEAR(data(v, v), c * a / (1 - a), 1e-6 * c * 4);
      EXPECT_NEAR(joint.rightHandSide[i], c * a / (1 - a) * target, 1e-6 * c * 4);
    }
    EXPECT_EQ(data.sum(), data.diagonal().sum());
  }
  // α β = 1 would be an infinite weight.
  observation.confidences = {1.f, 1.f};
  const auto strong =
      assemble(observation, priorOptions(Prior::membrane, Energy::joint, std::nextafter(1.f, 0.f)), execution);
  EXPECT_NEAR(strong.matrix.coeff(1, 1), 6e6, 10);
}

namespace {

/// Σ (1 − a_i) U(d_i) + a_i (d_i − d°_i)² as the paper writes it.
class PaperEnergy {
public:
  PaperEnergy(const Observation& observation, const PriorOptions& options)
      : size_(observation.lattice.size), options_(options), a_(static_cast<std::size_t>(size_.count()), 0),
        target_(a_.size(), 0)
  {
    for (std::size_t n = 0; n < observation.voxels.size(); ++n) {
      const auto voxel = static_cast<std::size_t>(observation.voxels[n]);
      a_[voxel] = static_cast<double>(observation.confidences[n]) * static_cast<double>(options.beta);
      target_[voxel] = static_cast<double>(observation.distances[n]);
    }
  }

  double operator()(const std::vector<double>& d) const
  {
    double sum = 0;
    for (std::int64_t i = 0; i < size_.count(); ++i) {
      const auto v = static_cast<std::size_t>(i);
      sum += (1 - a_[v]) * clique(d, i) + a_[v] * std::pow(d[v] - target_[v], 2);
    }
    return sum;
  }

private:
  std::vector<std::int64_t> neighbors(std::int64_t i) const
  {
    std::vector<std::int64_t> found;
    const Eigen::Array3i at = size_.voxel(i);
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        Eigen::Array3i other = at;
        other[axis] += step;
        if (size_.contains(other.x(), other.y(), other.z()))
          found.push_back(size_.index(other.x(), other.y(), other.z()));
      }
    return found;
  }

  double offMean(const std::vector<double>& d, std::int64_t i) const // l_i
  {
    const auto all = neighbors(i);
    double sum = 0;
    for (const std::int64_t j : all)
      sum += d[static_cast<std::size_t>(j)];
    return d[static_cast<std::size_t>(i)] - sum / static_cast<double>(all.size());
  }

  double clique(const std::vector<double>& d, std::int64_t i) const // U(d_i)
  {
    const auto all = neighbors(i);
    double sum = 0;
    for (const std::int64_t j : all)
      sum += options_.kind == Prior::membrane
                 ? std::pow(d[static_cast<std::size_t>(i)] - d[static_cast<std::size_t>(j)], 2) /
                       static_cast<double>(all.size())
                 : std::pow(offMean(d, i) - offMean(d, j), 2);
    return sum;
  }

  GridSize size_;
  PriorOptions options_;
  std::vector<double> a_, target_;
};

} // namespace

TEST(Assemble, thePapersEnergyIsTheOneThatItWrites)
{
  Execution execution(2);
  for (const Prior prior : allPriors)
    for (const GridSize& size : {GridSize{6, 5, 7}, GridSize{9, 1, 4}}) {
      const Observation observation = observeSphere(size);
      const PriorOptions options = priorOptions(prior, Energy::paper, .9f);
      const LinearSystem system = assemble(observation, options, execution);
      const PaperEnergy paperEnergy(observation, options);
      std::vector<double> d = oracle::randomValues(static_cast<std::size_t>(size.count()), -1, 1, 5), product(d.size());
      multiply(system, d, product, execution);
      for (std::size_t i = 0; i < d.size(); ++i) {
        const double before = d[i];
        d[i] = before + .5;
        const double above = paperEnergy(d);
        d[i] = before - .5;
        const double below = paperEnergy(d);
        d[i] = before;
        // Central differences of a quadratic are its derivative, whatever the step.
        ASSERT_NEAR(2 * (product[i] - system.rightHandSide[i]), above - below, 1e-10) << "k = " << order(prior);
      }
    }
}

TEST(Assemble, smoothingLengthsOfThePapersEnergyAreThoseOfItsInterior)
{
  // Where all voxels are observed with a constant a, rows divided by (1 − a) are L^k times a factor, and w.
  Execution execution;
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
    const LinearSystem system = assemble(observation, options, execution);
    const Prior power = prior == Prior::membrane ? prior : Prior::triharmonic;
    const oracle::Matrix expected = oracle::priorMatrix(size, power);
    const double factor = system.matrix.coeff(center, beside) / expected.coeff(center, beside);
    const double coefficient = .75 / factor; // w of L^k + c w
    EXPECT_NEAR(system.matrix.coeff(center, center), factor * centerCoefficient(power) + .75, 1e-9);
    EXPECT_NEAR(smoothingLength(options, 1), std::pow(coefficient, -.5 / order(power)), 1e-6);
  }
}

TEST(Assemble, energyAndResidualAreThoseOfTheMatrix)
{
  Execution execution;
  for (const Energy energyKind : allEnergies)
    for (const Prior prior : allPriors) {
      const GridSize size{9, 8, 7};
      const auto system = assemble(observeSphere(size), priorOptions(prior, energyKind), execution);
      const auto x = oracle::randomValues(static_cast<std::size_t>(size.count()), -1, 1, 11);
      const auto b = asVector(system.rightHandSide);
      const oracle::Vector product = system.matrix * asVector(x);
      // Rounding of a sum of a few hundred terms.
      EXPECT_NEAR(relativeResidual(system, x, execution), (b - product).norm() / b.norm(), 1e-11);
      const double expected = (.5 * asVector(x).dot(product) - b.dot(asVector(x))) / static_cast<double>(size.count());
      EXPECT_NEAR(energy(system, x, execution), expected, 1e-11 * std::abs(expected));
    }
}
