// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/lines_of_sight.h"

#include "support/clouds.h"
#include "support/shapes.h"
#include "support/threads.h"
#include "trimming/viewpoints.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

using namespace pcl::mrf;

namespace {

/// A wall that faces up, seen from 2 above its middle.
OrientedPoints seenWall()
{
  const PointSet wall = clouds::lattice(40, .05f);
  OrientedPoints points = shapes::oriented(wall);
  points.spacings.assign(wall.size(), .05f);
  points.sensors = {boundingBox(wall.positions).lower + Eigen::Vector3f(1, 1, 2)};
  return points;
}

bool isSeenThrough(const OrientedPoints& points, float height)
{
  const Eigen::Vector3f below(points.sensors.front().x(), points.sensors.front().y(), height);
  return seenThrough({{below, .25f}}, points, serial).front() != 0;
}

/// Share of the points of a square patch of 5 × 5, at this height above the seen wall, that the wall contradicts.
double contradictedShare(float height, float spacing)
{
  OrientedPoints points = seenWall();
  const auto wall = static_cast<std::uint32_t>(points.size());
  const float side = 4 * spacing;
  const Eigen::Vector3f corner = points.sensors.front() + Eigen::Vector3f(-side / 2, -side / 2, height - 2);
  std::vector<std::uint32_t> asked;
  for (int n = 0; n < 25; ++n) {
    asked.push_back(static_cast<std::uint32_t>(points.size()));
    points.positions.emplace_back(corner +
                                  spacing * Eigen::Vector3f(static_cast<float>(n % 5), static_cast<float>(n / 5), 0));
    points.normals.emplace_back(Eigen::Vector3f::UnitZ());
    points.spacings.push_back(spacing);
  }
  const std::vector<double> areas = {4, .1};
  const Surfaces surfaces = {[&](std::uint32_t point) { return point < wall ? 0 : 1; }, areas};
  const std::vector<std::uint8_t> flags = contradicted(asked, surfaces, points, serial);
  return static_cast<double>(std::count(flags.begin(), flags.end(), std::uint8_t{1})) / 25;
}

} // namespace

TEST(LinesOfSight, ContradictASurfaceThroughWhichALargerOneWasSeen)
{
  EXPECT_GT(contradictedShare(1, .06f), .9) << "five of the wall's points for each of its own";
  EXPECT_EQ(contradictedShare(1, .02f), 0) << "between its points nothing is seen";
  EXPECT_EQ(contradictedShare(.3f, .06f), 0) << "a tenth of the wall's points is next to it";
}

TEST(LinesOfSight, ContradictASurfaceBehindALargerOne)
{
  EXPECT_GT(contradictedShare(-2, .06f), .5);
  EXPECT_EQ(contradictedShare(-.3f, .06f), 0);
}

TEST(LinesOfSight, OfTheOnlySensorTellWhatIsBeforeTheWall)
{
  const OrientedPoints points = seenWall();
  EXPECT_TRUE(isSeenThrough(points, 1));
  EXPECT_FALSE(isSeenThrough(points, -1)) << "behind the wall";
  EXPECT_FALSE(isSeenThrough(points, .1f)) << "within the margin of the wall";
}

TEST(LinesOfSight, OfSeveralTellByViews)
{
  OrientedPoints points = seenWall();
  points.sensors.emplace_back(points.sensors.front() - Eigen::Vector3f(0, 0, 4)); // below, sees the wall's back
  EXPECT_FALSE(isSeenThrough(points, 1)) << "nobody tells that the upper sensor saw the wall";
  points.views.assign(points.size(), 0);
  EXPECT_TRUE(isSeenThrough(points, 1));
  points.views.assign(points.size(), -1);
  EXPECT_FALSE(isSeenThrough(points, 1));
}

TEST(LinesOfSight, WithoutSensorsTellNothing)
{
  OrientedPoints points = seenWall();
  const Eigen::Vector3f place = points.positions.front();
  points.sensors.clear();
  EXPECT_EQ(seenThrough({{place, .25f}}, points, serial).front(), 0);
}

TEST(Viewpoints, OfAScannerOnTheMoveTakeNoTime)
{
  constexpr int sensors = 300000;
  const PointSet wall = clouds::lattice(100, .05f);
  OrientedPoints points = shapes::oriented(wall);
  const Eigen::Vector3f middle = (boundingBox(wall.positions).lower + boundingBox(wall.positions).upper) / 2;
  for (int n = 0; n < sensors; ++n) // from side to side, 2 above it
    points.sensors.emplace_back(middle + Eigen::Vector3f(6 * static_cast<float>(n) / sensors - 3, 0, 2));
  const auto start = std::chrono::steady_clock::now();
  const Viewpoints viewpoints(points);
  ASSERT_TRUE(viewpoints.areKnown());
  EXPECT_NEAR(viewpoints.facing(middle, Eigen::Vector3f::UnitZ()), 1, .01);
  EXPECT_NEAR(viewpoints.facing(middle, Eigen::Vector3f(.8f, 0, .6f)), 1, .01);
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 5); // all would take 12
}
