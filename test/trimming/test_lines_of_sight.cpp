// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/lines_of_sight.h"

#include "support/clouds.h"

#include <gtest/gtest.h>

using namespace pcl::mrf;

namespace {

/// A wall that faces up, seen from 2 above its middle.
OrientedPoints seenWall()
{
  const PointSet wall = clouds::lattice(40, .05f);
  OrientedPoints points;
  points.positions = wall.positions;
  points.normals = wall.normals;
  points.spacings.assign(wall.size(), .05f);
  points.sensors = {boundingBox(wall.positions).lower + Eigen::Vector3f(1, 1, 2)};
  return points;
}

Sight sightOf(const OrientedPoints& points, float height)
{
  Execution execution(1);
  const Eigen::Vector3f below(points.sensors.front().x(), points.sensors.front().y(), height);
  return lookAt({{below, .25f}}, points, execution).front();
}

} // namespace

TEST(LinesOfSight, OfTheOnlySensorTellBothSides)
{
  const OrientedPoints points = seenWall();
  EXPECT_EQ(sightOf(points, 1), Sight::through);
  EXPECT_EQ(sightOf(points, -1), Sight::hidden);
  EXPECT_EQ(sightOf(points, .1f), Sight::free) << "within the margin of the wall";
}

TEST(LinesOfSight, OfSeveralTellWhatIsSeenThroughByViews)
{
  OrientedPoints points = seenWall();
  points.sensors.emplace_back(points.sensors.front() - Eigen::Vector3f(0, 0, 4)); // below, sees the wall's back
  EXPECT_EQ(sightOf(points, 1), Sight::free) << "nobody tells that the upper sensor saw the wall";
  EXPECT_EQ(sightOf(points, -1), Sight::free) << "the lower sensor sees the place";
  points.views.assign(points.size(), 0);
  EXPECT_EQ(sightOf(points, 1), Sight::through);
  points.views.assign(points.size(), -1);
  EXPECT_EQ(sightOf(points, 1), Sight::free);
  points.sensors[1] = points.sensors[0] + Eigen::Vector3f(.1f, 0, 0);
  EXPECT_EQ(sightOf(points, -1), Sight::hidden) << "from both";
}

TEST(LinesOfSight, WithoutSensorsAllIsFree)
{
  OrientedPoints points = seenWall();
  const Eigen::Vector3f place = points.positions.front();
  points.sensors.clear();
  Execution execution(1);
  EXPECT_EQ(lookAt({{place, .25f}}, points, execution).front(), Sight::free);
}
