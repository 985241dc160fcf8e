// SPDX-License-Identifier: BSD-3-Clause
// Compares draws from the posterior with the matrix whose inverse is their covariance.
#include "field/prior.h"
#include "solver/grids.h"
#include "support/linear_systems.h"
#include "support/threads.h"
#include "uncertainty/posterior_draws.h"

#include <Eigen/SparseCholesky>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace pcl::mrf;
using namespace systems;

namespace {

/// Directions along which a covariance is checked: single voxels amid and far from the data, and all voxels at random.
std::vector<oracle::Vector> directions(const GridSize& size)
{
  std::vector<oracle::Vector> result;
  const auto count = static_cast<Eigen::Index>(size.count());
  for (const std::int64_t voxel : {size.index(size.x / 5, size.y / 2, size.z / 2), size.index(0, 0, 0),
                                   size.index(size.x / 2, size.y / 2, size.z - 3), size.count() - 1})
    result.push_back(oracle::Vector::Unit(count, static_cast<Eigen::Index>(voxel)));
  std::mt19937 random(5);
  for (int n = 0; n < 20; ++n) {
    oracle::Vector q(count);
    for (Eigen::Index i = 0; i < count; ++i)
      q[i] = static_cast<double>(uniform(random, 2)) - 1;
    result.push_back(q);
  }
  return result;
}

/// The mean squares of draw(n) along each direction, n = 1 .. count.
template <typename Draw>
std::vector<double> meanSquares(const std::vector<oracle::Vector>& along, int count, const Draw& draw)
{
  std::vector<double> sums(along.size(), 0);
  for (int n = 1; n <= count; ++n) {
    const auto values = draw(static_cast<std::uint64_t>(n));
    const oracle::Vector e = Eigen::Map<const Eigen::VectorXf>(values.data(), static_cast<Eigen::Index>(values.size()))
                                 .template cast<double>();
    for (std::size_t q = 0; q < along.size(); ++q)
      sums[q] += std::pow(along[q].dot(e), 2) / count;
  }
  return sums;
}

/// The mean of n squared normal numbers has a standard error of √(2/n); one in 370 is off by more than three of these.
void expectVariances(const std::vector<double>& seen, const std::vector<double>& expected, int count)
{
  const double error = std::sqrt(2. / count);
  double sum = 0;
  int beyond = 0;
  for (std::size_t q = 0; q < seen.size(); ++q) {
    beyond += std::abs(seen[q] / expected[q] - 1) > 3 * error ? 1 : 0;
    EXPECT_NEAR(seen[q] / expected[q], 1, 4 * error) << "direction " << q;
    if (q >= 4) // random directions are all but independent
      sum += seen[q] / expected[q];
  }
  EXPECT_LE(beyond, 1);
  const auto random = static_cast<double>(seen.size() - 4);
  EXPECT_NEAR(sum / random, 1, 3 * error / std::sqrt(random) + .02); // long waves make some of them depend on others
}

TEST(NormalDraws, areNormalAndIndependent)
{
  const int count = 200000;
  double sum = 0, squares = 0, fourth = 0, product = 0, otherDraw = 0, otherKind = 0;
  const NormalDraws draws(1, 7), other(1, 8);
  for (int i = 0; i < count; ++i) {
    const auto index = static_cast<std::uint64_t>(i);
    const auto [a, b] = draws.pair(NormalDraws::Kind::samples, index);
    sum += a;
    squares += static_cast<double>(a) * a;
    fourth += std::pow(static_cast<double>(a), 4);
    product += static_cast<double>(a) * b;
    otherDraw += static_cast<double>(a) * other.pair(NormalDraws::Kind::samples, index)[0];
    otherKind += static_cast<double>(a) * draws.pair(NormalDraws::Kind::voxels, index)[0];
  }
  // Four standard errors of the mean, and of the moments: √2, √96, 1 over √n.
  const double error = 4 / std::sqrt(static_cast<double>(count));
  EXPECT_NEAR(sum / count, 0, error);
  EXPECT_NEAR(squares / count, 1, std::sqrt(2.) * error);
  EXPECT_NEAR(fourth / count, 3, std::sqrt(96.) * error);
  for (const double mean : {product, otherDraw, otherKind})
    EXPECT_NEAR(mean / count, 0, error);
  EXPECT_EQ(draws.pair(NormalDraws::Kind::edges, 5), NormalDraws(1, 7).pair(NormalDraws::Kind::edges, 5));
  EXPECT_NE(draws.pair(NormalDraws::Kind::edges, 5), NormalDraws(2, 7).pair(NormalDraws::Kind::edges, 5));
}

TEST(PosteriorDraws, termsHaveTheSystemAsTheirCovariance)
{
  Execution execution(2);
  for (const bool atPoints : {true, false})
    for (const Prior prior : allPriors) {
      SCOPED_TRACE(testing::Message() << "k = " << order(prior) << (atPoints ? " at points" : " at voxels"));
      const SphereLevel level({9, 8, 7}, prior, atPoints);
      const oracle::Matrix matrix = oracle::Matrix(level.plain().matrix);
      const std::vector<oracle::Vector> along = directions(level.size());
      const int count = 2000;
      const std::vector<double> seen = meanSquares(along, count, [&](std::uint64_t n) {
        return drawOfTerms(level.grids.front(), level.size(), prior, NormalDraws(1, n), execution);
      });
      std::vector<double> expected;
      for (const oracle::Vector& q : along)
        expected.push_back(q.dot(matrix * q));
      expectVariances(seen, expected, count);
    }
}

TEST(PosteriorDraws, haveTheInverseAsTheirCovariance)
{
  Execution execution(2);
  for (const Prior prior : allPriors) {
    SCOPED_TRACE(testing::Message() << "k = " << order(prior));
    const SphereLevel level({16, 16, 16}, prior);
    const Eigen::SimplicialLDLT<oracle::Matrix> factor(oracle::Matrix(level.plain().matrix));
    ASSERT_EQ(factor.info(), Eigen::Success);
    const std::vector<oracle::Vector> along = directions(level.size());
    std::vector<double> expected;
    for (const oracle::Vector& q : along)
      expected.push_back(q.dot(factor.solve(q)));
    const int count = 400;
    expectVariances(meanSquares(along, count,
                                [&](std::uint64_t n) {
                                  return drawOfPosterior(level.grids, level.size(), prior, NormalDraws(1, n), 40,
                                                         execution);
                                }),
                    expected, count);
  }
}

TEST(PosteriorDraws, areTheSameBytesForAnyNumberOfThreads)
{
  for (const Prior prior : allPriors) {
    const SphereLevel level({70, 60, 50}, prior); // more than serialVoxels
    const NormalDraws draws(3, 1);
    sameOnAnyThreads([&](int threads) {
      Execution execution(threads);
      return std::make_pair(drawOfTerms(level.grids.front(), level.size(), prior, draws, execution),
                            drawOfPosterior(level.grids, level.size(), prior, draws, 2, execution));
    });
  }
}

} // namespace
