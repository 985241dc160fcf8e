// SPDX-License-Identifier: BSD-3-Clause
#include "points/ghost_points.h"
#include "support/threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace pcl::mrf;

namespace {

/// A long hall as stations in it see it, and a pillar with a radius of .4 that some of them see.
struct Hall {
  PointSet points;
  std::vector<Eigen::Vector3f> normals;
  std::vector<std::uint8_t> isOfPillar;
};

/// \param stations along the hall \param seeing the first of them, so many, see the pillar
Hall hallWithPillar(int stations, int seeing)
{
  constexpr int rings = 120, ofRing = 2 * rings;
  constexpr float pi = 3.14159265f, radius = .4f;
  const Eigen::Array3f upper(12, 2, 3), lower(0, -2, 0);
  const Eigen::Vector2f pillar(6, .5f);
  Hall hall;
  for (int s = 0; s < stations; ++s) {
    const Eigen::Vector3f sensor(1 + 10 * static_cast<float>(s) / static_cast<float>(stations - 1), -.7f, 1.4f);
    hall.points.sensors.push_back(sensor);
    for (int n = 0; n < rings * ofRing; ++n) {
      const float polar = pi * (static_cast<float>(n / ofRing) + .5f) / rings,
                  around = 2 * pi * (static_cast<float>(n % ofRing) + .1f * static_cast<float>(s)) / ofRing;
      const Eigen::Vector3f direction(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                                      std::cos(polar));
      const Eigen::Array3f walls =
          ((upper - sensor.array()) / direction.array()).max((lower - sensor.array()) / direction.array());
      Eigen::Index axis = 0;
      const float toWall = walls.minCoeff(&axis);
      const Eigen::Vector2f across = direction.head<2>(), offset = sensor.head<2>() - pillar;
      const float b = across.dot(offset) / across.squaredNorm(),
                  root = b * b - (offset.squaredNorm() - radius * radius) / across.squaredNorm();
      const bool isPillar = s < seeing && root > 0 && b < 0 && -b - std::sqrt(root) < toWall;
      const float range = isPillar ? -b - std::sqrt(root) : toWall;
      hall.points.positions.emplace_back(sensor + range * direction);
      hall.points.views.push_back(s);
      hall.points.spacings.push_back(range * pi / rings / 2);
      const Eigen::Vector2f outward = hall.points.positions.back().head<2>() - pillar;
      hall.normals.push_back(isPillar ? Eigen::Vector3f(outward.x(), outward.y(), 0).normalized()
                                      : Eigen::Vector3f(Eigen::Vector3f::Unit(axis)));
      hall.isOfPillar.push_back(isPillar ? 1 : 0);
    }
  }
  return hall;
}

std::vector<std::uint8_t> keptOf(const Hall& hall, int threads = 2)
{
  Execution execution(threads);
  const auto search = makePointBins();
  search->setPoints(hall.points.positions, execution);
  std::vector<std::uint8_t> keep(hall.points.size(), 1);
  const std::int64_t dropped = dropGhosts(hall.points, hall.normals, *search, keep, execution);
  EXPECT_EQ(dropped, std::count(keep.begin(), keep.end(), std::uint8_t{0}));
  return keep;
}

std::int64_t keptOfPillar(const Hall& hall, const std::vector<std::uint8_t>& keep)
{
  std::int64_t kept = 0;
  for (std::size_t i = 0; i < keep.size(); ++i)
    kept += hall.isOfPillar[i] && keep[i] ? 1 : 0;
  return kept;
}

} // namespace

TEST(GhostPoints, AreWhatOtherSensorsSawThrough)
{
  for (const int seeing : {1, 2, 6}) { // of six
    SCOPED_TRACE(seeing);
    const Hall hall = hallWithPillar(6, seeing);
    const std::vector<std::uint8_t> keep = keptOf(hall);
    const auto all = std::count(hall.isOfPillar.begin(), hall.isOfPillar.end(), std::uint8_t{1}),
               dropped = std::count(keep.begin(), keep.end(), std::uint8_t{0}), kept = keptOfPillar(hall, keep);
    ASSERT_GT(all, 100);
    EXPECT_LT(static_cast<double>(dropped - (all - kept)), .001 * static_cast<double>(keep.size()))
        << "walls, floor and ceiling stay, which are seen at grazing angles";
    if (seeing == 6)
      EXPECT_EQ(kept, all);
    else
      EXPECT_LT(static_cast<double>(kept), .3 * static_cast<double>(all)) << "near the floor and at silhouettes";
  }
}

TEST(GhostPoints, NeedKnownViewsOfSeveralSensors)
{
  Hall hall = hallWithPillar(6, 1);
  hall.points.views.clear();
  EXPECT_EQ(keptOfPillar(hall, keptOf(hall)),
            std::count(hall.isOfPillar.begin(), hall.isOfPillar.end(), std::uint8_t{1}));
  const std::vector<std::uint8_t> ofTwo = keptOf(hallWithPillar(2, 1));
  EXPECT_EQ(std::count(ofTwo.begin(), ofTwo.end(), std::uint8_t{0}), 0) << "who knows which of them is right";
}

TEST(GhostPoints, DoNotDependOnThreads)
{
  const Hall hall = hallWithPillar(4, 1);
  sameOnAnyThreads([&](int threads) { return keptOf(hall, threads); });
}
