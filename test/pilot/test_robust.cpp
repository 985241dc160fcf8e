// SPDX-License-Identifier: BSD-3-Clause
#include "pilot/robust.h"

// Structured outliers, dropped by a robust field.
#include "base/random.h"
#include "support/clouds.h"
#include "support/shapes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <random>

using namespace pcl::mrf;

namespace {

constexpr float spacing = .05f;

std::vector<std::uint8_t> kept(const OrientedPoints& points, int threads = 2)
{
  Execution execution(threads);
  const auto search = clouds::searchOf(points);
  return keptByField(points, *search, spacing, 2 * spacing, 0, execution);
}

std::size_t dropped(const std::vector<std::uint8_t>& keep, std::size_t begin, std::size_t end)
{
  return static_cast<std::size_t>(std::count(keep.begin() + static_cast<std::ptrdiff_t>(begin),
                                             keep.begin() + static_cast<std::ptrdiff_t>(end), std::uint8_t{0}));
}

/// A torus with discs of 30 points a little off its surface, as dense as the surface and with right normals.
struct Clustered {
  OrientedPoints points;
  std::size_t inliers = 0;

  explicit Clustered(double noise)
  {
    PointSet cloud = shapes::sample(shapes::torus(1, .4), 1.6, spacing);
    shapes::addNoise(cloud, noise);
    points = shapes::oriented(cloud);
    inliers = points.size();
    std::mt19937 random(1);
    for (int cluster = 0; cluster < 6; ++cluster) {
      const std::size_t center = random() % inliers;
      const Eigen::Vector3f normal = points.normals[center];
      const Eigen::Vector3f side = normal.unitOrthogonal(), other = normal.cross(side);
      for (int n = 0; n < 30; ++n) {
        const float u = spacing * static_cast<float>(n % 6 - 3), v = spacing * static_cast<float>(n / 6 - 2);
        points.positions.push_back(points.positions[center] + .35f * normal + u * side + v * other);
        points.normals.push_back(normal);
      }
    }
  }
};

} // namespace

TEST(Robust, clustersOffTheSurfaceAreRejected)
{
  for (const double noise : {0., .3 * spacing}) {
    const Clustered clustered(noise);
    const auto keep = kept(clustered.points);
    EXPECT_GE(dropped(keep, clustered.inliers, keep.size()), 175u) << "of 180: some end up close to another part";
    EXPECT_LE(dropped(keep, 0, clustered.inliers), clustered.inliers / 200);
  }
}

TEST(Robust, clustersInFreeSpaceAreRejected)
{
  PointSet cloud = shapes::sample(shapes::torus(1, .4), 1.6, spacing);
  OrientedPoints points = shapes::oriented(cloud);
  const std::size_t inliers = points.size();
  const NormalDraws draws(2, 0);
  std::uint64_t drawn = 0;
  // In the torus' hole and around it, 10 to 20 spacings from its surface.
  for (const Eigen::Vector3f& center :
       {Eigen::Vector3f(0, 0, 0), {0, 0, 1}, {1.8f, 0, .4f}, {0, -2.2f, 0}, {1, 1, 1}}) {
    const Eigen::Vector3f normal = (center + Eigen::Vector3f(.3f, -.5f, .7f)).normalized();
    const Eigen::Vector3f side = normal.unitOrthogonal(), other = normal.cross(side);
    for (int n = 0; n < 30; ++n) {
      const auto [u, v] = draws.pair(NormalDraws::Kind::samples, drawn++);
      points.positions.push_back(center + 2 * spacing * (u * side + v * other));
      points.normals.push_back(normal);
    }
  }
  const auto keep = kept(points);
  EXPECT_EQ(dropped(keep, inliers, keep.size()), 150u);
  EXPECT_EQ(dropped(keep, 0, inliers), 0u);
}

TEST(Robust, cleanShapesAndSmallPiecesStay)
{
  // A disc of less than 50 points with a gap all around, as between occluders; then a cloud that is nothing else.
  const auto gap = [](const Eigen::Vector3f& p) {
    const float distance = (p - Eigen::Vector3f(0, 0, 1)).norm();
    return distance > .18f && distance < .4f;
  };
  const PointSet points = shapes::sample(shapes::sphere(1), 1.6, spacing);
  const OrientedPoints torn = shapes::oriented(shapes::filter(points, [&](const auto& p) { return !gap(p); }));
  ASSERT_LT(torn.size(), points.size());
  EXPECT_EQ(dropped(kept(torn), 0, torn.size()), 0u);

  const OrientedPoints few = shapes::oriented(
      shapes::filter(points, [](const auto& p) { return (p - Eigen::Vector3f(0, 0, 1)).norm() < .18f; }));
  ASSERT_LT(few.size(), 50u);
  ASSERT_GT(few.size(), 20u);
  EXPECT_EQ(dropped(kept(few), 0, few.size()), 0u);

  for (const auto& sdf : {shapes::torus(1, .4), shapes::box(Eigen::Vector3d(.9, .7, .5))}) {
    const OrientedPoints whole = shapes::oriented(shapes::sample(sdf, 1.6, spacing));
    const auto keep = kept(whole);
    EXPECT_EQ(dropped(keep, 0, keep.size()), 0u);
  }
}

TEST(Robust, doesNotDependOnTheNumberOfThreads)
{
  const Clustered clustered(.3 * spacing);
  EXPECT_EQ(kept(clustered.points, 1), kept(clustered.points, 4));
}
