// SPDX-License-Identifier: BSD-3-Clause
#include "points/outliers.h"
#include "support/clouds.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <pcl/surface/mrf/options.h>

#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

using namespace pcl::mrf;

namespace {

OutlierResult outliersOf(const PointSet& points, const OutlierOptions& options = {}, int threads = 1)
{
  Execution execution(threads);
  const auto search = clouds::searchOf(points);
  return findOutliers(points, measureNeighbors(points, *search, execution), *search, options, execution);
}

PointSet withoutNormals(PointSet points)
{
  points.normals.clear();
  return points;
}

PointSet sphere()
{
  return shapes::sample(shapes::sphere(1), 1.2, .08);
}

enum class Planted { apart, anywhere };

/// Appends points with random normals at least 6 spacings away from the sphere's surface and, if they are to be apart,
/// from each other.
void plantOutliers(PointSet& points, int number, Planted planting = Planted::apart)
{
  const auto clean = static_cast<std::ptrdiff_t>(points.size());
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> coordinate(-3, 3);
  for (int planted = 0; planted < number;) {
    const Eigen::Vector3f x(coordinate(random), coordinate(random), coordinate(random));
    const auto last = planting == Planted::apart ? points.positions.end() : points.positions.begin() + clean;
    const bool isFree =
        std::all_of(points.positions.begin(), last, [&](const Eigen::Vector3f& p) { return (p - x).norm() > .5f; });
    if (!isFree)
      continue;
    clouds::append(points, x, Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized());
    ++planted;
  }
}

} // namespace

TEST(Outliers, NoneOnCleanSurfaces)
{
  for (const shapes::Sdf& sdf : {shapes::sphere(1), shapes::torus(1, .4), shapes::box({1, .8, .6})}) {
    const PointSet points = shapes::sample(sdf, 1.6, .08);
    EXPECT_EQ(outliersOf(points).droppedAlone, 0);
    EXPECT_EQ(outliersOf(withoutNormals(points)).droppedAlone, 0);
  }
}

TEST(Outliers, PlantedOnesAreFoundAndNothingElse)
{
  PointSet points = sphere();
  const std::size_t clean = points.size();
  plantOutliers(points, 30);
  const OutlierResult result = outliersOf(points);
  EXPECT_GE(result.droppedAlone, 29); // the others, and the sphere, lie along a surface with one by chance
  for (std::size_t i = 0; i < clean; ++i)
    EXPECT_TRUE(result.keep[i]) << i;
}

TEST(Outliers, ManyAreNoSurfaceOfTheirOwn)
{
  // Amid so many their eight nearest are outliers, and five of these on a plane with one by chance.
  PointSet points = sphere();
  const auto clean = static_cast<std::ptrdiff_t>(points.size());
  plantOutliers(points, 1500, Planted::anywhere);
  const OutlierResult result = outliersOf(withoutNormals(points));
  EXPECT_GE(result.droppedAlone, 1485);
  EXPECT_EQ(std::count(result.keep.begin(), result.keep.begin() + clean, 1), clean);
}

TEST(Outliers, ASparsePartOfTheSurfaceIsNone)
{
  // A wall with a hundredth of the density of the object before it, and six points of something behind the object's
  // edge: far beside the median of the cloud, and beside the object's spacing, but on one plane with each other.
  PointSet points = clouds::lattice(100, .02f);
  clouds::append(points, clouds::lattice(12, .2f), {0, 0, -3});
  for (int n = 0; n < 6; ++n)
    clouds::append(points, {8 + .3f * static_cast<float>(n % 3), .4f * static_cast<float>(n / 3), -2.f},
                   Eigen::Vector3f::UnitZ());
  EXPECT_EQ(outliersOf(points).droppedAlone, 0);
  EXPECT_EQ(outliersOf(withoutNormals(points)).droppedAlone, 0);
}

TEST(Outliers, ASparsePartMayBeRough)
{
  // Points a fifth apart in the mean, and half as far off their plane: few have five of eight neighbors in one plane.
  PointSet points = clouds::lattice(100, .02f);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> along(0, 5);
  std::normal_distribution<float> across(-3, .1f);
  for (int n = 0; n < 600; ++n) {
    const float x = along(random), y = along(random);
    clouds::append(points, {x, y, across(random)}, Eigen::Vector3f::UnitZ());
  }
  EXPECT_LE(outliersOf(withoutNormals(points)).droppedAlone, 6);
}

TEST(Outliers, AreToldByTheSpacingAroundThem)
{
  // Half of the points are nine times as dense. A point two of their own spacings above them is close beside the
  // median of the cloud, but alone there.
  PointSet points = clouds::lattice(60, .01f);
  clouds::append(points, clouds::lattice(60, .09f), {20, 0, 0});
  clouds::append(points, {.005f, .005f, .08f}, Eigen::Vector3f::UnitX());
  const OutlierResult result = outliersOf(points);
  EXPECT_EQ(result.droppedAlone, 1);
  EXPECT_EQ(result.keep.back(), 0);
}

TEST(Outliers, StatisticalIsPclsAndCriteriaAddUp)
{
  PointSet points = sphere();
  plantOutliers(points, 30);
  auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const Eigen::Vector3f& p : points.positions)
    cloud->push_back({p.x(), p.y(), p.z()});
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(cloud);
  filter.setMeanK(8);
  filter.setStddevMulThresh(3);
  pcl::Indices kept;
  filter.filter(kept);

  OutlierOptions both, onlyStatistical;
  both.statistical = onlyStatistical.statistical = true;
  onlyStatistical.alone = false;
  const OutlierResult statistical = outliersOf(points, onlyStatistical);
  EXPECT_EQ(statistical.droppedByStatistics, static_cast<std::int64_t>(points.size() - kept.size()));
  EXPECT_GE(statistical.droppedByStatistics, 20);
  for (const int i : kept)
    EXPECT_TRUE(statistical.keep[static_cast<std::size_t>(i)]) << i;

  const OutlierResult alone = outliersOf(points), result = outliersOf(points, both);
  EXPECT_EQ(result.droppedAlone, alone.droppedAlone);
  EXPECT_EQ(result.droppedAlone + result.droppedByStatistics,
            std::count(result.keep.begin(), result.keep.end(), std::uint8_t{0}));
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(result.keep[i], alone.keep[i] & statistical.keep[i]) << i;
}

TEST(Outliers, FewerPointsThanNeighbors)
{
  OutlierOptions options;
  options.statistical = true;
  for (int number = 1; number < 10; ++number) {
    PointSet points;
    for (int n = 0; n < number; ++n)
      clouds::append(points, {static_cast<float>(n), 0, 0}, Eigen::Vector3f::UnitZ());
    const OutlierResult result = outliersOf(points, options);
    EXPECT_EQ(std::count(result.keep.begin(), result.keep.end(), 1), number);
  }
  EXPECT_TRUE(findOutliers({}, {}, *makeKdTree(), options, serial).keep.empty());
}

TEST(Outliers, DoNotDependOnThreadsOrderOrScale)
{
  PointSet points = sphere();
  plantOutliers(points, 30);
  const OutlierOptions options;
  const auto keep = sameOnAnyThreads([&](int threads) { return outliersOf(points, options, threads).keep; });

  const std::vector<std::uint32_t> order = clouds::shuffledOrder(points.size());
  const OutlierResult shuffled = outliersOf(clouds::reordered(points, order), options);
  for (std::size_t n = 0; n < order.size(); ++n)
    EXPECT_EQ(shuffled.keep[n], keep[order[n]]);

  for (const float factor : {1e-3f, 1e3f})
    EXPECT_EQ(outliersOf(clouds::scaled(points, factor)).keep, keep);
}
