// SPDX-License-Identifier: BSD-3-Clause
#include "points/sampling_density.h"
#include "support/clouds.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

using namespace pcl::mrf;

namespace {

SamplingDensity densityOf(const PointSet& points, int threads = 1, LengthUnit unit = LengthUnit::density)
{
  Execution execution(threads);
  const NeighborDistances distances = measureNeighbors(points, *clouds::searchOf(points), execution);
  return estimateSamplingDensity(points, distances, execution, unit);
}

} // namespace

TEST(SamplingDensity, OfALatticeIsItsSpacing)
{
  const PointSet points = clouds::lattice(40, .5f);
  const SamplingDensity density = densityOf(points);
  // Exact but for the rounding of coordinates of ten spacings to single precision.
  EXPECT_NEAR(density.nearestMean, .5, 1e-5);
  EXPECT_NEAR(density.nearestDeviation, 0, 1e-5);
  EXPECT_NEAR(density.eighthMedian, .5 * std::sqrt(2.0), 1e-5);
  EXPECT_FLOAT_EQ(density.spacing, .323f * density.eighthMedian);
  EXPECT_EQ(densityOf(points, 1, LengthUnit::nearest).spacing, density.nearestMean);
}

TEST(SamplingDensity, NeighborsGrowWithThePowerOfTheirDimension)
{
  Execution execution(2);
  const auto growthIn = [&](std::size_t count, int dimension) {
    PointSet points = clouds::randomSquare(count, 1);
    std::mt19937 random(2);
    std::uniform_real_distribution<float> uniform(-1, 1);
    for (Eigen::Vector3f& position : points.positions) {
      position.y() = dimension > 1 ? position.y() : 0;
      position.z() = dimension > 2 ? uniform(random) : 0;
    }
    return growthOfNeighbors(points.positions, *clouds::searchOf(points), execution);
  };
  EXPECT_NEAR(growthIn(5000, 1), 1, .1);
  EXPECT_NEAR(growthIn(5000, 2), 2, .15);
  EXPECT_NEAR(growthIn(20000, 3), 2.9, .15); // some are near the cube's faces
  EXPECT_EQ(growthIn(1000, 3), 2) << "too few to tell";
}

TEST(SamplingDensity, OfRandomPointsIsTheExpectationOfAPoissonProcess)
{
  // 20,000 points in an area of 4: mean nearest distance ½ ρ^(-½), standard deviation ((4 − π)/4π ρ)^½, and the 8th
  // neighbor's median (7.669/π ρ)^½. The border (1 % of the points) and chance make less than 3 %.
  const SamplingDensity density = densityOf(clouds::randomSquare(20000, 1));
  const double scale = 1 / std::sqrt(5000.0);
  EXPECT_NEAR(density.nearestMean / scale, .5, .015);
  EXPECT_NEAR(density.nearestDeviation / scale, std::sqrt((4 - M_PI) / (4 * M_PI)), .01);
  EXPECT_NEAR(density.eighthMedian / scale, std::sqrt(7.669 / M_PI), .047);
  // The factor makes both estimates equal on such a surface.
  EXPECT_NEAR(density.spacing, density.nearestMean, .03 * density.nearestMean);
}

TEST(SamplingDensity, LocalSpacingsFollowTheDensity)
{
  // Two squares far apart, one with a ninth of the other's density.
  PointSet points = clouds::lattice(60, .1f), sparse = clouds::lattice(20, .3f);
  const std::size_t dense = points.size();
  for (Eigen::Vector3f& position : sparse.positions)
    position.x() += 100;
  clouds::append(points, sparse);
  const NeighborDistances distances = measureNeighbors(points, *clouds::searchOf(points), serial);
  const std::vector<float> spacings = localSpacings(points, distances, serial);
  ASSERT_EQ(spacings.size(), points.size());
  for (std::size_t i = 0; i < spacings.size(); ++i) {
    // .323 √2 of the lattice's constant, up to .323 · √8 at its corners.
    const float constant = i < dense ? .1f : .3f;
    EXPECT_GE(spacings[i], .999f * .323f * std::sqrt(2.f) * constant) << i;
    EXPECT_LE(spacings[i], 1.001f * .323f * std::sqrt(8.f) * constant) << i;
  }
}

TEST(SamplingDensity, DuplicatesCountOnce)
{
  const PointSet once = clouds::randomSquare(500, 1);
  PointSet repeated = once;
  for (std::size_t i = 0; i < once.size(); i += 3) // up to 20 times: more than the neighbors that are looked at
    for (std::size_t n = 0; n < i % 20; ++n)
      clouds::append(repeated, once.positions[i], once.normals[i]);
  const SamplingDensity expected = densityOf(once), density = densityOf(repeated);
  // The same distances, added in another order.
  EXPECT_NEAR(density.nearestMean, expected.nearestMean, 1e-6 * expected.nearestMean);
  EXPECT_NEAR(density.nearestDeviation, expected.nearestDeviation, 1e-6 * expected.nearestMean);
  EXPECT_EQ(density.eighthMedian, expected.eighthMedian);
}

TEST(SamplingDensity, NeedsTwoDistinctPositions)
{
  PointSet points;
  const auto density = [&] { densityOf(points); };
  EXPECT_NE(clouds::messageOf<InvalidInput>(density), "");
  clouds::append(points, {1, 2, 3}, Eigen::Vector3f::UnitZ());
  EXPECT_NE(clouds::messageOf<InvalidInput>(density), "");
  for (int n = 0; n < 20; ++n)
    clouds::append(points, {1, 2, 3}, Eigen::Vector3f::UnitZ());
  EXPECT_NE(clouds::messageOf<InvalidInput>(density), "");
  clouds::append(points, {1, 2, 5}, Eigen::Vector3f::UnitZ());
  EXPECT_FLOAT_EQ(densityOf(points).spacing, 2);
  // Squared distances of 1e-60 are zero in single precision.
  EXPECT_NE(clouds::messageOf<InvalidInput>([] { densityOf(clouds::scaled(clouds::lattice(10, 1), 1e-30f)); }), "");
}

TEST(SamplingDensity, FewPointsHaveNoEighthNeighbor)
{
  PointSet points = clouds::lattice(2, 1);
  EXPECT_EQ(densityOf(points).eighthMedian, 0);
  EXPECT_FLOAT_EQ(densityOf(points).spacing, 1);
  clouds::append(points, clouds::lattice(2, 3)); // 8 points: 7 neighbors each
  EXPECT_EQ(densityOf(points).eighthMedian, 0);
  clouds::append(points, {0, 0, 0}, Eigen::Vector3f::UnitZ());
  EXPECT_GT(densityOf(points).eighthMedian, 0);
}

TEST(SamplingDensity, IsTheSameBytesForAnyNumberOfThreads)
{
  const PointSet points = clouds::randomSquare(20000, 1);
  sameOnAnyThreads([&](int threads) {
    const SamplingDensity density = densityOf(points, threads);
    return std::array<float, 4>{density.spacing, density.nearestMean, density.nearestDeviation, density.eighthMedian};
  });
}

TEST(SamplingDensity, ScalesWithTheCloudAndIgnoresItsOrder)
{
  const PointSet points = shapes::sample(shapes::sphere(1), 1.2, .08);
  const SamplingDensity density = densityOf(points);
  for (const float factor : {1e-3f, 1e3f}) {
    const SamplingDensity other = densityOf(clouds::scaled(points, factor));
    // Coordinates are rounded to 6e-8 of the radius, 1e-6 of the spacing.
    EXPECT_NEAR(other.spacing / factor, density.spacing, 2e-6 * density.spacing);
    EXPECT_NEAR(other.nearestDeviation / factor, density.nearestDeviation, 2e-6 * density.spacing);
  }
  const SamplingDensity shuffled = densityOf(clouds::reordered(points, clouds::shuffledOrder(points.size())));
  EXPECT_NEAR(shuffled.spacing, density.spacing, 1e-6 * density.spacing); // the sum's order
  EXPECT_EQ(shuffled.eighthMedian, density.eighthMedian);
}
