// SPDX-License-Identifier: BSD-3-Clause
#include "points/normals.h"
#include "points/sampling_density.h"
#include "support/clouds.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <pcl/surface/mrf/report.h>

#include <pcl/features/normal_3d_omp.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>

using namespace pcl::mrf;

namespace {

NormalEstimates normalsOf(const PointSet& points, const NormalOptions& options = {}, int threads = 1, float noise = 0)
{
  Execution execution(threads);
  const auto search = clouds::searchOf(points);
  // The paper's noise criteria come with the paper's l̄.
  const LengthUnit unit = options.noiseCriteria ? LengthUnit::nearest : LengthUnit::density;
  const float spacing =
      estimateSamplingDensity(points, measureNeighbors(points, *search, execution), execution, unit).spacing;
  return estimateNormals(points, *search, spacing, options, execution, noise);
}

/// Angles between the estimates and the points' normals up to sign, degrees, ascending.
std::vector<double> errorsOf(const PointSet& points, const NormalEstimates& estimates)
{
  std::vector<double> errors;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d a = points.normals[i].cast<double>(), b = estimates.normals[i].cast<double>();
    errors.push_back(std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) * (180 / static_cast<double>(EIGEN_PI)));
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

} // namespace

TEST(Normals, OfASphereConvergeWithTheSpacing)
{
  // The bias of a plane fit is the curvature times the neighborhood's asymmetry: of first order in the spacing.
  double previous = 0;
  for (const double spacing : {.16, .08, .04}) {
    const PointSet points = shapes::sample(shapes::sphere(1), 1.2, spacing);
    const std::vector<double> errors = errorsOf(points, normalsOf(points));
    const double median = errors[errors.size() / 2];
    EXPECT_LT(median, 10 * spacing); // .4 degrees at .04
    if (previous > 0) {
      EXPECT_LT(median, .7 * previous);
    }
    previous = median;
  }
}

TEST(Normals, AreAsGoodAtAnyScale)
{
  const PointSet points = shapes::sample(shapes::torus(1, .4), 1.6, .08);
  const NormalEstimates expected = normalsOf(points);
  for (const float factor : {1e-3f, 1e3f, 1e-9f, 1e9f}) {
    const NormalEstimates estimates = normalsOf(clouds::scaled(points, factor));
    for (std::size_t i = 0; i < points.size(); ++i) {
      // A point on the radius may move in or out by rounding: most are equal, all are close.
      EXPECT_GT(std::abs(estimates.normals[i].dot(expected.normals[i])), .999f) << i;
    }
  }
}

TEST(Normals, AgreeWithPclsOwn)
{
  const PointSet points = shapes::sample(shapes::torus(1, .4), 1.6, .08);
  NormalOptions options;
  options.radius = .25f;
  auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const Eigen::Vector3f& p : points.positions)
    cloud->push_back({p.x(), p.y(), p.z()});
  pcl::NormalEstimationOMP<pcl::PointXYZ, pcl::Normal> estimation(1);
  estimation.setInputCloud(cloud);
  estimation.setSearchMethod(std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  estimation.setRadiusSearch(options.radius);
  pcl::PointCloud<pcl::Normal> expected;
  estimation.compute(expected);

  const NormalEstimates estimates = normalsOf(points, options);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(estimates.normals[i], Eigen::Vector3f(expected[i].getNormalVector3fMap())) << i;
}

TEST(Normals, NoiseCriteriaTellVolumesFromSurfaces)
{
  std::mt19937 random(3);
  std::normal_distribution<float> coordinate;
  PointSet blob;
  for (int n = 0; n < 4000; ++n) {
    const float x = coordinate(random), y = coordinate(random), z = coordinate(random);
    clouds::append(blob, {x, y, z}, Eigen::Vector3f::UnitZ());
  }
  NormalOptions options;
  options.radius = 1;
  options.noiseCriteria = true;
  const NormalEstimates estimates = normalsOf(blob, options);
  std::int64_t inside = 0, noise = 0;
  for (std::size_t i = 0; i < blob.size(); ++i) {
    if (blob.positions[i].norm() > 1)
      continue;
    ++inside;
    noise += estimates.isNoise[i];
  }
  EXPECT_GT(inside, 500);
  EXPECT_EQ(noise, inside);
}

TEST(Normals, NoiseCriteriaFindPointsOffTheSurface)
{
  PointSet points = clouds::lattice(40, .1f);
  const std::size_t clean = points.size();
  for (int n = -3; n <= 3; ++n) // 1.5 spacings off, above the middle of a cell, far from each other
    clouds::append(points, {.5f * static_cast<float>(n), .5f * static_cast<float>(n), .15f}, Eigen::Vector3f::UnitZ());
  NormalOptions options;
  options.noiseCriteria = true;
  const NormalEstimates estimates = normalsOf(points, options);
  for (std::size_t i = 0; i < points.size(); ++i) // a point of the plane sees at most one planted point among 20
    EXPECT_EQ(estimates.isNoise[i], i < clean ? 0 : 1) << i;
}

TEST(Normals, NeighborhoodsReachTheNextRingOfALidar)
{
  const PointSet points = clouds::lidar();
  EXPECT_EQ(normalsOf(points, {}, 3, .05f).normals, normalsOf(points, {}, 1, .05f).normals) << "on three threads";
  const std::vector<double> errors = errorsOf(points, normalsOf(points));
  EXPECT_LT(errors[errors.size() / 2], 2);
  EXPECT_LT(errors[errors.size() * 9 / 10], 5); // edges of the boxes, and single rings of far walls, are beyond
  // The nearest points alone are of one ring, and say nothing of the ground between the rings.
  NormalOptions nearest;
  nearest.radius = 1e-3f; // so that the 12 nearest count
  const std::vector<double> ofOneRing = errorsOf(points, normalsOf(points, nearest));
  EXPECT_GT(ofOneRing[ofOneRing.size() * 9 / 10], 20) << "the case is too easy";
}

TEST(Normals, NoiseWidensTheNeighborhoods)
{
  PointSet points = clouds::randomSquare(40000, 1); // .01 = 1/√ρ
  for (const float noise : {.02f, .1f}) {
    PointSet noisy = points;
    shapes::addNoise(noisy, noise);
    const auto medianOf = [&](float known) {
      const std::vector<double> errors = errorsOf(noisy, normalsOf(noisy, {}, 1, known));
      return errors[errors.size() / 2];
    };
    // 200 points, and up to 128 that stand for 5,000: 2° and 4° in theory, in the middle of the noise.
    EXPECT_LT(medianOf(noise), 8) << noise;
    EXPECT_GT(medianOf(0), 25) << "the nearest points are a ball";
  }
  // Less noise than spacing changes little.
  PointSet sphere = shapes::sample(shapes::sphere(1), 1.2, .05);
  const std::vector<double> known = errorsOf(sphere, normalsOf(sphere, {}, 1, .005f)),
                            unknown = errorsOf(sphere, normalsOf(sphere));
  EXPECT_LT(known[known.size() / 2], 1.2 * unknown[unknown.size() / 2]);
}

TEST(Normals, LinesAndSinglePositionsHaveNone)
{
  for (const int number : {2, 3, 5, 50}) {
    PointSet line;
    for (int n = 0; n < number; ++n)
      clouds::append(line, Eigen::Vector3f(1, 2, 3) * (.1f * static_cast<float>(n)), Eigen::Vector3f::UnitZ());
    for (const Eigen::Vector3f& normal : normalsOf(line).normals)
      EXPECT_TRUE(normal.isZero()) << number << " points on a line: " << normal.transpose();
  }
  PointSet same;
  for (int n = 0; n < 20; ++n)
    clouds::append(same, {1, 2, 3}, Eigen::Vector3f::UnitZ());
  for (const Eigen::Vector3f& normal : estimateNormals(same, *clouds::searchOf(same), 1, {}, serial).normals)
    EXPECT_TRUE(normal.isZero());
  EXPECT_TRUE(estimateNormals({}, *makeKdTree(), 1, {}, serial).normals.empty());
}

TEST(Normals, OfSomePointsAreThoseOfAll)
{
  const PointSet points = clouds::randomSquare(2000, 1);
  const auto search = clouds::searchOf(points);
  const std::vector<std::uint32_t> asked = {3, 700, 1999};
  const auto all = estimateNormals(points, *search, .02f, {}, serial, .05f).normals,
             some = estimateNormals(points, *search, .02f, {}, serial, .05f, asked).normals;
  for (const std::uint32_t i : asked)
    EXPECT_EQ(some[i], all[i]);
  EXPECT_EQ(std::count_if(some.begin(), some.end(), [](const Eigen::Vector3f& n) { return n.isZero(); }), 1997);
}

TEST(Normals, ANarrowStripIsAPlane)
{
  PointSet points; // a thousand times as long as wide
  for (int n = 0; n < 100; ++n)
    clouds::append(points, {static_cast<float>(n), n % 2 == 0 ? 0 : .01f, 0}, Eigen::Vector3f::UnitZ());
  EXPECT_LT(errorsOf(points, normalsOf(points)).back(), .1);
}

TEST(Normals, AreTheSameBytesForAnyNumberOfThreads)
{
  PointSet points = shapes::sample(shapes::torus(1, .4), 1.6, .06);
  shapes::addNoise(points, .02);
  NormalOptions options;
  options.noiseCriteria = true;
  const auto normals = std::get<0>(sameOnAnyThreads([&](int threads) {
    const NormalEstimates e = normalsOf(points, options, threads);
    return std::make_tuple(e.normals, e.isNoise);
  }));
  const std::vector<std::uint32_t> order = clouds::shuffledOrder(points.size());
  const NormalEstimates shuffled = normalsOf(clouds::reordered(points, order), options);
  for (std::size_t n = 0; n < order.size(); ++n) // the order of equal distances may differ, and with it a sum's
    EXPECT_GT(std::abs(shuffled.normals[n].dot(normals[order[n]])), 1 - 1e-5f);
}
