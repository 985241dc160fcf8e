// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/lines_of_sight.h"

#include "support/clouds.h"
#include "support/shapes.h"
#include "support/threads.h"
#include "trimming/viewpoints.h"

#include <gtest/gtest.h>

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

} // namespace

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
