// SPDX-License-Identifier: BSD-3-Clause
#include "points/preprocessing.h"
#include "points/sensor_view.h"
#include "support/clouds.h"
#include "support/threads.h"

#include <gtest/gtest.h>

using namespace pcl::mrf;

namespace {

constexpr std::size_t count = 4000;

/// Points of a ball of radius 1 whose heights are at least `bottom`, with a sensor above it.
PointSet ball(double bottom, float height)
{
  PointSet points;
  for (const Eigen::Vector3d& position : clouds::spherePoints(count))
    if (position.z() >= bottom)
      points.positions.emplace_back(position.cast<float>());
  points.sensors = {{0, 0, height}};
  return points;
}

double hiddenShareOf(double bottom)
{
  const PointSet points = ball(bottom, 3);
  return hiddenShare(points, std::vector<float>(points.size(), .056f), serial);
}

PreparedPoints prepared(double bottom, float height, bool isOwn, Report& report)
{
  PointSet points = ball(bottom, height);
  points.hasSensorOrigin = isOwn;
  const std::unique_ptr<NeighborSearch> search = makePointBins();
  return preprocess(std::move(points), {}, *search, report, serial);
}

} // namespace

TEST(HiddenShare, IsNothingOfWhatTheSensorSaw)
{
  EXPECT_LT(hiddenShareOf(1. / 3), .01) << "as much as is seen from 3 above the middle";
}

TEST(HiddenShare, TellsABallThatWasSeenAllAround)
{
  EXPECT_GT(hiddenShareOf(-1), .2);
}

TEST(Views, ThatNameOtherSensorsAreToldOf)
{
  const auto warningsOf = [](float above) {
    PointSet points = ball(-1, 5);
    points.sensors.emplace_back(0, 0, -5);
    for (const Eigen::Vector3f& position : points.positions)
      points.views.push_back(above * position.z() > 0 ? 0 : 1);
    Report report;
    preprocess(std::move(points), {}, *makePointBins(), report, serial);
    return report.warnings;
  };
  EXPECT_TRUE(warningsOf(1).empty());
  const std::vector<std::string> swapped = warningsOf(-1);
  ASSERT_EQ(swapped.size(), 1u);
  EXPECT_NE(swapped.front().find("do the views (RawCloud::views) name the sensors"), std::string::npos) << swapped[0];
}

TEST(SensorOrigin, ThatCannotHaveSeenThePointsIsNotUsed)
{
  Report seen, registered, given;
  EXPECT_EQ(prepared(1. / 3, 3, true, seen).points.sensors.size(), 1u);
  EXPECT_TRUE(seen.warnings.empty());
  EXPECT_TRUE(prepared(-1, 3, true, registered).points.sensors.empty());
  ASSERT_EQ(registered.warnings.size(), 1u);
  EXPECT_NE(registered.warnings.front().find("which was not used"), std::string::npos);
  EXPECT_EQ(prepared(-1, 3, false, given).points.sensors.size(), 1u) << "a sensor that was given stays";
  EXPECT_EQ(given.warnings.size(), 1u);
}

TEST(SensorOrigin, InsideOfThePointsStays)
{
  Report report;
  PointSet points = ball(-1, 0);
  for (int n = 0; n < 400; ++n) // a ball in the room, which hides a part of it
    points.positions.emplace_back(points.positions[static_cast<std::size_t>(10 * n)] * .2f +
                                  Eigen::Vector3f(.4f, 0, 0));
  points.hasSensorOrigin = true;
  const std::unique_ptr<NeighborSearch> search = makePointBins();
  EXPECT_EQ(preprocess(std::move(points), {}, *search, report, serial).points.sensors.size(), 1u);
}
