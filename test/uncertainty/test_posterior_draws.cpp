// SPDX-License-Identifier: BSD-3-Clause
// Draws from the posterior against the matrix whose inverse is their covariance.
#include "field/prior.h"
#include "solver/grid_solver.h"
#include "solver/grids.h"
#include "support/linear_systems.h"
#include "uncertainty/posterior_draws.h"

#include <Eigen/SparseCholesky>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace pcl::mrf;
using namespace systems;

namespace {

/// Directions to look at a covariance along: single voxels amid the data and far from them, and all voxels at random.
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

/// Mean squares of what draw(n) says along each direction, n = 1 .. count.
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

/// The mean of n squared normal numbers has a standard error of √(2/n): one in 370 is off by more than three.
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
    Execution one(1), three(3);
    const NormalDraws draws(3, 1);
    EXPECT_EQ(drawOfTerms(level.grids.front(), level.size(), prior, draws, one),
              drawOfTerms(level.grids.front(), level.size(), prior, draws, three));
    EXPECT_EQ(drawOfPosterior(level.grids, level.size(), prior, draws, 2, one),
              drawOfPosterior(level.grids, level.size(), prior, draws, 2, three));
  }
}

/// What points observe of a field: a row for the value at each and three for its gradient, times the roots of their
/// weights, so that the noise of all is 1.
oracle::Matrix rowsOf(const std::vector<PointSample>& points, const GridSize& size, const PointWeights& weights)
{
  std::vector<Eigen::Triplet<double>> entries;
  int row = 0;
  for (const PointSample& point : points) {
    const Eigen::Array3i cell = point.position.array().floor().cast<int>();
    const Eigen::Array3d f = point.position.cast<double>().array() - cell.cast<double>();
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Array3i side(corner & 1, corner >> 1 & 1, corner >> 2);
      const Eigen::Array3d weight = (side == 1).select(f, 1 - f), slope = 2 * side.cast<double>() - 1;
      const auto voxel = static_cast<int>(size.index(cell.x() + side.x(), cell.y() + side.y(), cell.z() + side.z()));
      const double mass = static_cast<double>(point.weight);
      entries.emplace_back(row, voxel, std::sqrt(mass * weights.value) * weight.prod());
      for (int axis = 0; axis < 3; ++axis)
        entries.emplace_back(row + 1 + axis, voxel,
                             std::sqrt(mass * weights.gradient) * slope[axis] * weight[(axis + 1) % 3] *
                                 weight[(axis + 2) % 3]);
    }
    row += 4;
  }
  oracle::Matrix rows(row, static_cast<Eigen::Index>(size.count()));
  rows.setFromTriplets(entries.begin(), entries.end());
  return rows;
}

oracle::Vector normalNumbers(Eigen::Index count, std::mt19937& random)
{
  std::normal_distribution<double> normal;
  return oracle::Vector::NullaryExpr(count, [&] { return normal(random); });
}

/// Fields that are what the model takes them for: drawn from its prior, which a few weak points keep from being
/// improper, and observed at points with its noise.
class TrueFields {
public:
  TrueFields(const GridSize& size, Prior prior)
      : data_(SphereLevel::pointsOnSphere(size)), level_(size, prior, true, weak(size))
  {
    rows_ = rowsOf(data_, size, level_.observation.weights);
    const oracle::Matrix posterior = oracle::Matrix(level_.plain().matrix), ofData = rows_.transpose() * rows_;
    const oracle::Matrix few = rowsOf(weak(size), size, level_.observation.weights);
    const oracle::Matrix ofPrior = posterior - ofData,
                         expected = oracle::priorMatrix(size, prior) + oracle::Matrix(few.transpose() * few);
    EXPECT_LT((ofPrior - expected).norm(), 1e-5 * posterior.norm()) << "the rows are those of the system; floats";
    prior_.compute(expected);
    EXPECT_EQ(prior_.info(), Eigen::Success);
  }

  const SphereLevel& level() const { return level_; }

  /// A field and what the production solver makes of its observation. \return the difference
  oracle::Vector error(std::mt19937& random) const
  {
    const oracle::Vector noise = normalNumbers(rows_.rows(), random),
                         field = prior_.permutationPinv() *
                                 oracle::Vector(prior_.matrixU().solve(normalNumbers(rows_.cols(), random)));
    const oracle::Vector b = rows_.transpose() * (rows_ * field + noise);
    PackedValues rightHandSide(b.data(), b.data() + b.size());
    std::vector<float> estimate(static_cast<std::size_t>(b.size()), 0);
    SolverOptions solver;
    solver.changeTolerance = 0;
    Execution execution(1);
    solveOnGrids({level_.grids, level_.prior, level_.grids.front().voxels, &rightHandSide}, {steps}, solver, 1,
                 estimate.data(), execution);
    return Eigen::Map<const Eigen::VectorXf>(estimate.data(), b.size()).cast<double>() - field;
  }

  static constexpr int steps = 40; ///< to the solver's default tolerance, mostly fewer

private:
  static std::vector<PointSample> weak(const GridSize& size)
  {
    std::vector<PointSample> points;
    const Eigen::Vector3f extent = Eigen::Vector3i(size.x, size.y, size.z).cast<float>();
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3f at = Eigen::Array3i(corner & 1, corner >> 1 & 1, corner >> 2).cast<float>() * .6f + .15f;
      points.emplace_back(at.cwiseProduct(extent), Eigen::Vector3f::UnitX(), 1e-2f);
    }
    return points;
  }

  std::vector<PointSample> data_;
  SphereLevel level_;
  oracle::Matrix rows_;
  Eigen::SimplicialLLT<oracle::Matrix> prior_;
};

TEST(PosteriorDraws, holdTheFieldsThatTheModelIsTrueOf)
{
  // Nothing is calibrated here: 95 of 100 voxels are within 1.96 standard deviations of the draws.
  Execution execution(2);
  for (const Prior prior : allPriors) {
    SCOPED_TRACE(testing::Message() << "k = " << order(prior));
    const GridSize size{11, 10, 9};
    const TrueFields fields(size, prior);
    const int draws = 500, repetitions = 200;
    oracle::Vector variances = oracle::Vector::Zero(static_cast<Eigen::Index>(size.count()));
    for (int n = 0; n < draws; ++n) {
      const std::vector<float> draw =
          drawOfPosterior(fields.level().grids, size, prior, NormalDraws(1, static_cast<std::uint64_t>(n)),
                          TrueFields::steps, execution);
      variances += Eigen::Map<const Eigen::VectorXf>(draw.data(), variances.size()).cast<double>().cwiseAbs2() / draws;
    }
    std::mt19937 random(7);
    oracle::Vector shares(repetitions);
    for (double& share : shares)
      share = (fields.error(random).cwiseAbs2().array() <= 1.96 * 1.96 * variances.array()).cast<double>().mean();
    // Voxels of one field depend on each other, fields do not: their scatter tells how sure the mean is.
    const double mean = shares.mean(),
                 error = std::sqrt((shares.array() - mean).square().sum() / (repetitions - 1) / repetitions);
    EXPECT_LT(3 * error, .01) << "enough of them to tell";
    EXPECT_NEAR(mean, .95, .01);
  }
}

} // namespace
