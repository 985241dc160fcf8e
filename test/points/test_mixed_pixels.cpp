// SPDX-License-Identifier: BSD-3-Clause
#include "points/mixed_pixels.h"
#include "support/clouds.h"
#include "support/threads.h"

#include <Eigen/Geometry>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

using namespace pcl::mrf;

namespace {

constexpr int side = 160; // pixels

/// The depths that a camera sees along (x, y, 1) of each pixel, row by row.
using Image = std::vector<float>;

Image imageOf(const std::function<float(const Eigen::Vector3f& direction)>& depth)
{
  Image image;
  for (int v = 0; v < side; ++v)
    for (int u = 0; u < side; ++u)
      image.push_back(depth({static_cast<float>(u) / side - .5f, static_cast<float>(v) / side - .5f, 1}));
  return image;
}

/// The depth of a ball of radius .4 at distance 2 from the camera, or of the wall behind it.
float ballBeforeWall(const Eigen::Vector3f& direction)
{
  const float square = direction.squaredNorm(), root = 4 - square * (4 - .16f);
  return root > 0 ? (2 - std::sqrt(root)) / square : 5;
}

/// The depth of leaves before the wall, or of the wall.
float treeBeforeWall(const Eigen::Vector3f& direction, std::mt19937& random)
{
  const bool isLeaf = direction.head<2>().norm() < .25f && random() % 2 == 0;
  return isLeaf ? std::uniform_real_distribution<float>(2, 4)(random) : 5;
}

/// The depth of a receding plane, in the disparity steps of a depth camera.
float steppedPlane(const Eigen::Vector3f& direction)
{
  constexpr float steps = 120;
  return steps / std::round(steps * (.6f - direction.y()) / 2);
}

PointSet pointsOf(const Image& image, const Eigen::Vector3f& sensor = Eigen::Vector3f::Zero())
{
  PointSet points;
  for (int i = 0; i < side * side; ++i)
    points.positions.push_back(sensor + image[static_cast<std::size_t>(i)] *
                                            Eigen::Vector3f(static_cast<float>(i % side) / side - .5f,
                                                            static_cast<float>(i / side) / side - .5f, 1));
  points.sensors = {sensor};
  return points;
}

/// An empty room, seen from inside by a lidar whose rings are three times as far apart as the points of a ring.
PointSet roomOfRings()
{
  constexpr int rings = 90, ofRing = 6 * rings;
  constexpr float pi = 3.14159265f;
  const Eigen::Array3f upper(1.9f, 1, 2.5f), lower(-3.1f, -1.5f, -1.5f);
  PointSet points;
  for (int ring = 1; ring < rings; ++ring)
    for (int i = 0; i < ofRing; ++i) {
      const float polar = pi * static_cast<float>(ring) / rings, around = 2 * pi * static_cast<float>(i) / ofRing;
      const Eigen::Vector3f direction(std::sin(polar) * std::cos(around), std::cos(polar),
                                      std::sin(polar) * std::sin(around));
      points.positions.push_back(direction * (upper / direction.array()).max(lower / direction.array()).minCoeff());
    }
  points.sensors = {Eigen::Vector3f::Zero()};
  return points;
}

struct Mixed {
  Image image;
  std::vector<std::uint8_t> isMixed;
};

/// The ball and the wall, with a share of the pixels at the ball's silhouette between the two.
Mixed mixedImage(double share)
{
  Mixed mixed{imageOf(ballBeforeWall), std::vector<std::uint8_t>(side * side, 0)};
  const Image exact = mixed.image;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int v = 1; v + 1 < side; ++v)
    for (int u = 1; u + 1 < side; ++u) {
      const auto i = static_cast<std::size_t>(v * side + u);
      const float around[] = {exact[i - 1], exact[i + 1], exact[i - side], exact[i + side]};
      const auto [nearest, farthest] = std::minmax_element(std::begin(around), std::end(around));
      if (*farthest - *nearest < 1 || unit(random) >= share)
        continue;
      mixed.image[i] = *nearest + (.1f + .8f * unit(random)) * (*farthest - *nearest);
      mixed.isMixed[i] = 1;
    }
  return mixed;
}

std::vector<std::uint8_t> keptOf(const PointSet& points, int threads = 2)
{
  Execution execution(threads);
  std::vector<std::uint8_t> keep(points.size(), 1);
  const std::int64_t dropped = dropMixedPixels(points, *clouds::searchOf(points), keep, execution);
  EXPECT_EQ(dropped, std::count(keep.begin(), keep.end(), std::uint8_t{0}));
  return keep;
}

std::int64_t droppedOf(const PointSet& points)
{
  const std::vector<std::uint8_t> keep = keptOf(points);
  return std::count(keep.begin(), keep.end(), std::uint8_t{0});
}

} // namespace

TEST(MixedPixels, AreFoundBetweenTwoSurfaces)
{
  for (const double share : {.1, .5, 1.}) {
    const Mixed mixed = mixedImage(share);
    const std::vector<std::uint8_t> keep = keptOf(pointsOf(mixed.image));
    int all = 0, found = 0, others = 0;
    for (std::size_t i = 0; i < keep.size(); ++i) {
      all += mixed.isMixed[i];
      found += mixed.isMixed[i] && !keep[i] ? 1 : 0;
      others += !mixed.isMixed[i] && !keep[i] ? 1 : 0;
    }
    EXPECT_GT(all, 200 * share);
    EXPECT_GT(found, .85 * all) << share;
    EXPECT_LE(others, 2) << share;
  }
}

TEST(MixedPixels, NoneOnSurfacesAndTrees)
{
  std::mt19937 random(5);
  EXPECT_EQ(droppedOf(pointsOf(imageOf(ballBeforeWall))), 0);
  EXPECT_EQ(droppedOf(pointsOf(imageOf(steppedPlane))), 0);
  const PointSet room = roomOfRings();
  EXPECT_LT(droppedOf(room), .001 * static_cast<double>(room.size()));
  const PointSet tree =
      pointsOf(imageOf([&](const Eigen::Vector3f& direction) { return treeBeforeWall(direction, random); }));
  EXPECT_LT(droppedOf(tree), .002 * static_cast<double>(tree.size()));
}

TEST(MixedPixels, NoneOnAWallThatLinesOfSightCross)
{
  PointSet points; // a roof, the ground, and in each row one point of the wall between them
  std::mt19937 random(7);
  for (int row = 0; row < 60; ++row) {
    const auto y = static_cast<float>(row);
    for (int column = 0; column < 60; ++column)
      points.positions.emplace_back(static_cast<float>(column) - 29.5f, y, column < 30 ? 20.f : 0.f);
    points.positions.emplace_back(0.f, y, std::uniform_real_distribution<float>(4, 16)(random));
  }
  points.sensors = {{5, 30, 200}};
  EXPECT_GT(droppedOf(points), 40) << "a sheet along the lines of sight";
  points.sensors = {{5, 30, 1e5f}};
  EXPECT_EQ(droppedOf(points), 0) << "a direction is no device";
  points.sensors = {{40, 30, 200}};
  EXPECT_LT(droppedOf(points), 10) << "at the ends of the wall";
}

TEST(MixedPixels, AFewStay)
{
  Image image = imageOf(ballBeforeWall);
  const auto edge = std::adjacent_find(image.begin() + side / 2 * side, image.end(),
                                       [](float left, float right) { return left - right > 1; });
  ASSERT_NE(edge, image.end());
  *edge = 3;
  EXPECT_EQ(droppedOf(pointsOf(image)), 0);
}

TEST(MixedPixels, AreFoundInOneImageOfMany)
{
  const PointSet mixed = pointsOf(mixedImage(.5).image);
  PointSet points = mixed;
  while (points.size() <= 131072) // of more a sample is asked first
    for (const Eigen::Vector3f& position : pointsOf(imageOf(ballBeforeWall)).positions)
      points.positions.push_back(
          Eigen::AngleAxisf(1.05f * static_cast<float>(points.size() / (side * side)), Eigen::Vector3f::UnitX()) *
          position);
  EXPECT_NEAR(static_cast<double>(droppedOf(points)), static_cast<double>(droppedOf(mixed)), 2); // at its border
}

TEST(MixedPixels, DoNotDependOnThreads)
{
  const PointSet points = pointsOf(mixedImage(.5).image);
  sameOnAnyThreads([&](int threads) { return keptOf(points, threads); });
}

TEST(MixedPixels, AreThoseOfTheSensorThatSawThem)
{
  const Mixed mixed = mixedImage(.5);
  const std::int64_t once = droppedOf(pointsOf(mixed.image));
  PointSet points = pointsOf(mixed.image);
  const Eigen::Vector3f aside(1, 0, 0);
  for (const Eigen::Vector3f& position : pointsOf(mixed.image, aside).positions)
    points.positions.push_back(position);
  points.sensors.push_back(aside);
  EXPECT_EQ(droppedOf(points), 0) << "nobody knows which of them saw a point";
  points.views.assign(points.size(), 0);
  std::fill(points.views.begin() + static_cast<std::ptrdiff_t>(points.size() / 2), points.views.end(), 1);
  EXPECT_NEAR(static_cast<double>(droppedOf(points)), 2. * static_cast<double>(once), 2); // of rounding
}

TEST(MixedPixels, AreDroppedWhetherTheSensorIsGivenOrSupposed)
{
  PointSet points = pointsOf(mixedImage(.5).image);
  for (const Eigen::Vector3f& position : points.positions)
    points.normals.push_back(-position.normalized());
  const Reconstruction given = clouds::reconstruct(points);
  EXPECT_GT(given.report.points.mixedPixels, 100);
  points.sensors.clear();
  const Reconstruction supposed = clouds::reconstruct(points);
  ASSERT_TRUE(supposed.report.sensorSupposed);
  EXPECT_EQ(supposed.report.points.mixedPixels, given.report.points.mixedPixels);
  Options options;
  options.outliers.alone = false;
  EXPECT_EQ(clouds::reconstruct(points, options).report.points.mixedPixels, 0);
}
