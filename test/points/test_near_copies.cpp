// SPDX-License-Identifier: BSD-3-Clause
#include "points/near_copies.h"
#include "support/clouds.h"
#include "support/random.h"
#include "support/threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace pcl::mrf;

namespace {

/// A wall of 40 × 40 pixels, .05 apart, each measured `times` times with an error of .002 along the line of sight.
PointSet measuredAgain(int times)
{
  PointSet points = clouds::lattice(40, .05f);
  points.normals.clear();
  const std::vector<Eigen::Vector3f> wall = std::move(points.positions);
  points.positions.clear();
  std::mt19937 random(1);
  std::normal_distribution<float> error(0, .002f);
  for (int n = 0; n < times; ++n)
    for (const Eigen::Vector3f& pixel : wall)
      points.positions.push_back(pixel + error(random) * Eigen::Vector3f(.1f, .2f, .97f));
  return points;
}

int copiesOf(const PointSet& points)
{
  return countNearCopies(points.positions, *clouds::searchOf(points));
}

} // namespace

TEST(NearCopies, AreFoundByTheGapBehindThem)
{
  EXPECT_EQ(copiesOf(measuredAgain(1)), 0);
  EXPECT_EQ(copiesOf(measuredAgain(2)), 1);
  EXPECT_EQ(copiesOf(measuredAgain(12)), 8);
}

TEST(NearCopies, AreNotFoundOnLinesAndAmongRandomPoints)
{
  PointSet lines, random;
  std::mt19937 generator(1);
  std::uniform_real_distribution<float> uniform;
  for (int n = 0; n < 4000; ++n) { // ten points of each line within the distance of the next one
    lines.positions.emplace_back(.01f * static_cast<float>(n % 200), .1f * static_cast<float>(n / 200), 0.f);
    random.positions.emplace_back(uniform(generator), uniform(generator), 0.f);
  }
  EXPECT_EQ(copiesOf(lines), 0);
  EXPECT_EQ(copiesOf(random), 0);
}

TEST(NearCopies, AreNotTheSurfacesOfSmallObjects)
{
  PointSet balls;
  clouds::Random random(1);
  for (int n = 0; n < 1728; ++n) {
    const Eigen::Vector3f center = Eigen::Array3i(n % 11, n / 11 % 12, n / 132).cast<float>();
    for (int i = 0; i < 20; ++i)
      balls.positions.emplace_back(center + .05f * random.direction().cast<float>());
  }
  EXPECT_EQ(copiesOf(balls), 0);
}

TEST(NearCopies, LeaveTheOneInTheMiddle)
{
  const PointSet points = measuredAgain(12);
  std::vector<std::uint8_t> keep(points.size(), 1);
  const std::int64_t dropped = dropNearCopies(points, *clouds::searchOf(points), 8, keep, serial);
  EXPECT_EQ(dropped, std::count(keep.begin(), keep.end(), std::uint8_t{0}));
  const auto kept = static_cast<double>(points.size()) - static_cast<double>(dropped);
  EXPECT_NEAR(kept, 1600, 8) << "one of each pixel, but for copies far off";
  const PointSet pixels = clouds::lattice(40, .05f);
  double squares = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (keep[i])
      squares += (points.positions[i] - pixels.positions[i % pixels.size()]).squaredNorm();
  EXPECT_LT(std::sqrt(squares / kept), .001) << "the error of one is .002";
}

TEST(NearCopies, AreNotTheTwoSidesOfASheet)
{
  PointSet sheet = clouds::lattice(40, .05f);
  for (std::size_t i = 0; i < 1600; ++i) {
    sheet.positions.emplace_back(sheet.positions[i] - Eigen::Vector3f(0, 0, .001f));
    sheet.normals.emplace_back(-sheet.normals[i]);
  }
  ASSERT_EQ(copiesOf(sheet), 1);
  std::vector<std::uint8_t> keep(sheet.size(), 1);
  EXPECT_EQ(dropNearCopies(sheet, *clouds::searchOf(sheet), 1, keep, serial), 0);
}
