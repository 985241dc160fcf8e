// SPDX-License-Identifier: BSD-3-Clause
#include "field/prior.h"
#include "options/validation.h"
#include "solver/linear_system.h"
#include "support/lattice_matrix.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/options.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace pcl::mrf;

namespace {

const Prior allPriors[] = {Prior::membrane, Prior::thinPlate, Prior::triharmonic};

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

Eigen::VectorXd product(const GridSize& size, Prior prior, const std::vector<double>& x)
{
  return unobserved(size, prior).matrix *
         Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
}

} // namespace

TEST(Prior, isThePowerOfTheLaplacian)
{
  for (const Prior prior : allPriors)
    for (const GridSize& size : allSizes) {
      SCOPED_TRACE(testing::Message() << "k = " << order(prior) << ", " << size.x << " x " << size.y << " x "
                                      << size.z);
      EXPECT_EQ(Eigen::MatrixXd(unobserved(size, prior).matrix), Eigen::MatrixXd(oracle::priorMatrix(size, prior)));
    }
}

TEST(Prior, symmetricPositiveSemidefiniteWithConstantsAsNullSpace)
{
  for (const Prior prior : allPriors)
    for (const GridSize& size : {GridSize{6, 5, 4}, GridSize{5, 1, 7}}) {
      SCOPED_TRACE(testing::Message() << "k = " << order(prior));
      const Eigen::MatrixXd matrix(unobserved(size, prior).matrix);
      const double largest = std::pow(12.0, order(prior));
      EXPECT_EQ(matrix, matrix.transpose());
      EXPECT_TRUE((matrix.rowwise().sum().array() == 0).all());
      const oracle::Spectrum spectrum = oracle::spectrumOf(matrix);
      const Eigen::VectorXd& values = spectrum.values;
      EXPECT_NEAR(values[0], 0, 1e-13 * largest);
      // The smallest other eigenvalue of L is 2 − 2 cos(π/7) = .198 here.
      EXPECT_GT(values[1], std::pow(.19, order(prior)));
      EXPECT_LE(values[values.size() - 1], largest);
      EXPECT_LE((spectrum.first.array() - spectrum.first.mean()).abs().maxCoeff(), 1e-9);
    }
}

TEST(Prior, centerCoefficientsOfTheInterior)
{
  const GridSize size{9, 9, 9};
  for (const Prior prior : allPriors) {
    const std::int64_t center = size.index(4, 4, 4);
    EXPECT_EQ(unobserved(size, prior).matrix.coeff(center, center), centerCoefficient(prior));
  }
  EXPECT_EQ(centerCoefficient(Prior::membrane), 6);
  EXPECT_EQ(centerCoefficient(Prior::thinPlate), 42);
  EXPECT_EQ(centerCoefficient(Prior::triharmonic), 324);
}

TEST(Prior, annihilatesThePolynomialsBelowItsOrderInTheInterior)
{
  const GridSize size{11, 11, 11};
  std::vector<double> linear, cubic;
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) {
        linear.push_back(3 * x - 2 * y + z + 5);
        cubic.push_back(x * x * y - z * z * z + 2 * x * y * z + y * y);
      }
  const std::int64_t center = size.index(5, 5, 5);
  EXPECT_EQ(product(size, Prior::membrane, linear)[center], 0);
  EXPECT_EQ(product(size, Prior::thinPlate, cubic)[center], 0);
  EXPECT_EQ(product(size, Prior::triharmonic, cubic)[center], 0);
  // −Δ of x² is −2.
  std::vector<double> square;
  for (int i = 0; i < size.count(); ++i)
    square.push_back((i % size.x) * (i % size.x));
  EXPECT_EQ(product(size, Prior::membrane, square)[center], -2);
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

TEST(Prior, optionLimits)
{
  PriorOptions options;
  EXPECT_NO_THROW(validate(options));
  for (const float beta : {-.1f, 1.f, 2.f, std::numeric_limits<float>::quiet_NaN()}) {
    options.beta = beta;
    EXPECT_THROW(validate(options), InvalidOption) << beta;
  }
  options.beta = 0;
  EXPECT_NO_THROW(validate(options));
  options.kind = static_cast<Prior>(4);
  EXPECT_THROW(validate(options), InvalidOption);
  options = {};
  options.energy = static_cast<Energy>(7);
  EXPECT_THROW(validate(options), InvalidOption);
}
