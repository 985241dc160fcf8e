// SPDX-License-Identifier: BSD-3-Clause
#include "field/prior.h"
#include "options/validation.h"
#include "support/lattice_matrix.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/options.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

using namespace pcl::mrf;

namespace {

const Prior allPriors[] = {Prior::membrane, Prior::thinPlate, Prior::triharmonic};

// Odd, even, and one or two voxels thick along one, two and all axes.
const GridSize allSizes[] = {{7, 5, 6}, {8, 4, 8}, {17, 3, 9}, {1, 6, 5}, {6, 1, 5}, {6, 5, 1}, {2, 1, 9},
                             {9, 2, 1}, {1, 1, 7}, {7, 1, 1},  {1, 7, 1}, {2, 2, 2}, {1, 1, 1}, {3, 2, 4}};

PriorOperator makePrior(GridSize size, Prior prior, bool weighted)
{
  PriorOperator result{size, prior, {}};
  if (weighted)
    result.voxelWeights = oracle::randomValues(static_cast<std::size_t>(size.count()), .01, 1, 7);
  return result;
}

std::vector<double> product(const PriorOperator& prior, const std::vector<double>& x, int threads = 1)
{
  Execution execution(threads);
  std::vector<double> y(x.size(), std::numeric_limits<double>::quiet_NaN()), scratch;
  apply(prior, x.data(), y.data(), scratch, execution);
  return y;
}

Eigen::MatrixXd denseOperator(const PriorOperator& prior)
{
  const auto count = static_cast<Eigen::Index>(prior.size.count());
  Eigen::MatrixXd matrix(count, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    std::vector<double> unit(static_cast<std::size_t>(count));
    unit[static_cast<std::size_t>(j)] = 1;
    const std::vector<double> column = product(prior, unit);
    matrix.col(j) = Eigen::Map<const Eigen::VectorXd>(column.data(), count);
  }
  return matrix;
}

} // namespace

TEST(Prior, matrixFreeOperatorIsTheMatrixOfTheDefinition)
{
  for (const bool weighted : {false, true})
    for (const Prior prior : allPriors)
      for (const GridSize& size : allSizes) {
        SCOPED_TRACE(testing::Message() << "k = " << order(prior) << ", " << size.x << " x " << size.y << " x "
                                        << size.z << (weighted ? ", weighted" : ""));
        const auto op = makePrior(size, prior, weighted);
        const auto x = oracle::randomValues(static_cast<std::size_t>(size.count()), -1, 1, 3);
        const auto y = product(op, x);
        const Eigen::VectorXd expected =
            oracle::priorMatrix(op) * Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
        for (std::size_t i = 0; i < x.size(); ++i) // values up to 12^k, rounding 1e-16 each
          ASSERT_NEAR(y[i], expected[static_cast<Eigen::Index>(i)], 1e-12 * std::pow(12.0, order(prior)));
      }
}

TEST(Prior, symmetricPositiveSemidefiniteWithConstantsAsNullSpace)
{
  for (const bool weighted : {false, true})
    for (const Prior prior : allPriors)
      for (const GridSize& size : {GridSize{6, 5, 4}, GridSize{5, 1, 7}}) {
        SCOPED_TRACE(testing::Message() << "k = " << order(prior) << (weighted ? ", weighted" : ""));
        const Eigen::MatrixXd matrix = denseOperator(makePrior(size, prior, weighted));
        const double largest = std::pow(12.0, order(prior));
        EXPECT_LE((matrix - matrix.transpose()).cwiseAbs().maxCoeff(), 1e-15 * largest);
        const oracle::Spectrum spectrum = oracle::spectrumOf(matrix);
        const Eigen::VectorXd& values = spectrum.values;
        EXPECT_NEAR(values[0], 0, 1e-13 * largest);
        // The smallest other eigenvalue of L is 2 − 2 cos(π/7) = .198 here, of the weighted ones at least .01 of its
        // power.
        EXPECT_GT(values[1], .01 * std::pow(.19, order(prior)));
        EXPECT_LE(values[values.size() - 1], largest);
        EXPECT_LE((spectrum.first.array() - spectrum.first.mean()).abs().maxCoeff(), 1e-9);
      }
}

TEST(Prior, annihilatesConstantsExactly)
{
  for (const Prior prior : allPriors)
    for (const double constant : {1., .1, 12345.678}) {
      const GridSize size{13, 9, 6};
      for (const double value : product(makePrior(size, prior, false),
                                        std::vector<double>(static_cast<std::size_t>(size.count()), constant)))
        ASSERT_EQ(value, 0);
    }
}

TEST(Prior, centerCoefficientsOfTheInterior)
{
  const GridSize size{9, 9, 9};
  for (const Prior prior : allPriors) {
    std::vector<double> unit(static_cast<std::size_t>(size.count()));
    const auto center = static_cast<std::size_t>(size.index(4, 4, 4));
    unit[center] = 1;
    EXPECT_EQ(product(makePrior(size, prior, false), unit)[center], centerCoefficient(prior));
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
  const auto center = static_cast<std::size_t>(size.index(5, 5, 5));
  EXPECT_EQ(product(makePrior(size, Prior::membrane, false), linear)[center], 0);
  EXPECT_EQ(product(makePrior(size, Prior::thinPlate, false), cubic)[center], 0);
  EXPECT_EQ(product(makePrior(size, Prior::triharmonic, false), cubic)[center], 0);
  // −Δ of x² is −2.
  std::vector<double> square;
  for (int i = 0; i < size.count(); ++i)
    square.push_back((i % size.x) * (i % size.x));
  EXPECT_EQ(product(makePrior(size, Prior::membrane, false), square)[center], -2);
}

TEST(Prior, sameBytesForAnyNumberOfThreads)
{
  const GridSize size{61, 47, 43}; // above the size that is cut into slabs
  for (const bool weighted : {false, true})
    for (const Prior prior : allPriors) {
      const auto op = makePrior(size, prior, weighted);
      const std::vector<double> x = oracle::randomValues(static_cast<std::size_t>(size.count()), -1, 1, 5);
      const auto one = product(op, x, 1);
      for (const int threads : {2, 3, 4, 50}) // 50: slabs thinner than the operator's reach
        EXPECT_EQ(one, product(op, x, threads)) << threads << " threads, k = " << order(prior);
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
