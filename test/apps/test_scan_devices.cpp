// SPDX-License-Identifier: BSD-3-Clause
// The devices of the scanner simulator: each has the errors that it promises.

#include "scan/analytic_surface.h"
#include "scan/error_model.h"
#include "scan/mesh_surface.h"
#include "support/scan_meshes.h"
#include "support/shapes.h"

#include <pcl/surface/mrf/exceptions.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace pcl::mrf;
using namespace pcl::mrf::scan;
using namespace scan_meshes;
using Eigen::Vector3d;

namespace {

ScanOptions optionsOf(Device device, std::int64_t points, const Vector3d& sensor, const Vector3d& forward)
{
  ScanOptions options;
  adopt(device, options);
  options.sampling.points = points;
  options.sampling.grazingLimit = 88;
  options.sensors = {sensor};
  options.views.forward = forward;
  return options;
}

/// A square with sides of 1 at z = 0, and a wall behind it at z = −2.
MeshSurface screenBeforeWall()
{
  Soup soup;
  soup.quad({-.5, -.5, 0}, {.5, -.5, 0}, {.5, .5, 0}, {-.5, .5, 0});
  soup.quad({-20, -20, -2}, {20, -20, -2}, {20, 20, -2}, {-20, 20, -2});
  return {soup.vertices, soup.triangles};
}

/// How much farther than it is each point of a scan without outliers seems, and how far off its ray. \pre one sensor
std::vector<double> rangeErrors(const Scan& scan, double& offRay)
{
  EXPECT_EQ(scan.outliers, 0);
  std::vector<double> errors;
  offRay = 0;
  for (std::size_t i = 0; i < scan.clean.size(); ++i) {
    const Vector3d clean = scan.clean.positions[i] - scan.sensors[0], cloud = scan.cloud.positions[i] - scan.sensors[0];
    errors.push_back(cloud.norm() - clean.norm());
    offRay = std::max(offRay, clean.cross(cloud).norm() / clean.squaredNorm());
  }
  return errors;
}

/// The RMS of values whose key lies in a range.
double rmsWhere(const std::vector<double>& values, const std::vector<double>& keys, double lower, double upper)
{
  std::vector<double> some;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (keys[i] >= lower && keys[i] < upper)
      some.push_back(values[i]);
  EXPECT_GT(some.size(), 500u);
  return rootMeanSquare(some);
}

/// The correlation of values at places whose distance is within a range, of pairs in a sample.
double correlation(const std::vector<Vector3d>& places, const std::vector<double>& values, double lower, double upper)
{
  double products = 0, squares = 0;
  std::int64_t pairs = 0;
  const std::size_t count = std::min<std::size_t>(places.size(), 6000); // in no order
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (const double distance = (places[i] - places[j]).norm(); distance >= lower && distance < upper) {
        products += values[i] * values[j];
        squares += .5 * (values[i] * values[i] + values[j] * values[j]);
        ++pairs;
      }
  EXPECT_GT(pairs, 1000);
  return products / squares;
}

} // namespace

TEST(ScanDevices, SmoothFieldHasItsCovariance)
{
  // Over 60 fields: the standard error of a covariance is about 1/√60 of its deviation over fields, 1.4 at most, and
  // the 200 pairs of each field bring that down further.
  Random random(3, 1);
  std::vector<double> products(4);
  constexpr int fields = 60, pairs = 200;
  for (int f = 0; f < fields; ++f) {
    const SmoothField field(2, random);
    for (int pair = 0; pair < pairs; ++pair) {
      const Vector3d x = 100 * random.normalVector(), direction = random.direction();
      for (std::size_t d = 0; d < products.size(); ++d)
        products[d] += field(x) * field(x + 2. * static_cast<double>(d) * direction) / (fields * pairs);
    }
  }
  for (std::size_t d = 0; d < products.size(); ++d)
    EXPECT_NEAR(products[d], std::exp(-.5 * static_cast<double>(d * d)), .06) << d;
}

TEST(ScanDevices, DepthCameraErrsWithTheSquareOfTheDepth)
{
  // A wall seen at a slant: every depth, and every phase of the steps.
  const AnalyticSurface wall = shape("plane:width=40,height=40");
  const ScanOptions options = optionsOf(Device::depthCamera, 40000, {0, 0, 1}, {2, 0, -1});
  const Scan scan = scanOf(wall, options);
  EXPECT_NEAR(static_cast<double>(scan.clean.size()), 40000, 1600);
  double offRay = 0;
  rangeErrors(scan, offRay);
  EXPECT_LT(offRay, 1e-12);
  SamplingOptions sampling = options.sampling;
  sampling.forward = options.views.forward;
  const Eigen::Matrix3d frame = viewingFrame({0, 0, 1}, wall.boundingBox(), sampling);
  std::vector<double> depths, errors, disparityErrors;
  std::vector<Vector3d> pixels;
  for (std::size_t i = 0; i < scan.clean.size(); ++i) {
    const Vector3d seen = frame.transpose() * (scan.clean.positions[i] - options.sensors[0]);
    const double depth = seen[0], measured = frame.col(0).dot(scan.cloud.positions[i] - options.sensors[0]);
    // A field of view of 640 × 480 pixels.
    ASSERT_LE(std::abs(seen[1] / depth) * 580, 320 + 1e-9);
    ASSERT_LE(std::abs(seen[2] / depth) * 580, 240 + 1e-9);
    const double steps = 8 * 580 * .075 / measured;
    ASSERT_NEAR(steps, std::round(steps), 1e-8);
    depths.push_back(depth);
    errors.push_back(measured - depth);
    disparityErrors.push_back(43.5 / measured - 43.5 / depth);
    pixels.emplace_back(580 * seen[1] / depth, 580 * seen[2] / depth, 0);
  }
  const double perSquare = std::hypot(.08, .125 / std::sqrt(12)) / 43.5;
  for (const double depth : {1.2, 2., 3., 4.5}) {
    // Of the square, over a fifth of the depth: 1.0033 · depth².
    EXPECT_NEAR(rmsWhere(errors, depths, .9 * depth, 1.1 * depth) / (perSquare * depth * depth), 1, .1) << depth;
  }
  // Steps are shared by pixels as well; far apart nothing is.
  EXPECT_GT(correlation(pixels, disparityErrors, 1, 3), .5);
  EXPECT_LT(std::abs(correlation(pixels, disparityErrors, 60, 64)), .1);
}

TEST(ScanDevices, FlyingAndMixedPixelsLieBetweenSurfaces)
{
  const MeshSurface surface = screenBeforeWall();
  for (const Device device : {Device::depthCamera, Device::lidar}) {
    ScanOptions options = optionsOf(device, 20000, {0, 0, 2}, {0, 0, -1});
    options.noise = {};
    options.sampling.lowestElevation = -15;
    options.sampling.highestElevation = 15;
    const Scan scan = scanOf(surface, options);
    ASSERT_GT(scan.outliers, 20);
    EXPECT_EQ(scan.clean.size() + static_cast<std::size_t>(scan.outliers), scan.cloud.size());
    std::int64_t between = 0;
    for (const Vector3d& x : scan.cloud.positions) {
      // Disparity errors: 9 steps of z²/43.5/8 at most.
      ASSERT_LT(x.z(), .1);
      ASSERT_GT(x.z(), -2 - (device == Device::lidar ? 1e-9 : .6));
      const bool isBetween = x.z() < -1e-9 && x.z() > -2 + 1e-9;
      if (device == Device::depthCamera ? x.z() < -.2 && x.z() > -1.5 : isBetween) {
        ++between;
        // On a line of sight by the silhouette, which a footprint of 3.4 or 1.5 mrad to either side meets.
        const Vector3d atScreen = x * 2 / (2 - x.z());
        ASSERT_NEAR(atScreen.head<2>().lpNorm<Eigen::Infinity>(), .5, .02);
      }
    }
    EXPECT_LE(between, scan.outliers);
    EXPECT_GT(static_cast<double>(between), .5 * static_cast<double>(scan.outliers));
    if (device == Device::lidar) {
      EXPECT_EQ(between, scan.outliers);
    }
  }
}

TEST(ScanDevices, LidarErrsTheSameAtAllRangesAlongTheRay)
{
  ScanOptions options = optionsOf(Device::lidar, 20000, {0, 0, 1}, {1, 0, 0});
  options.noise = {.02, Length::Unit::cloud};
  options.views.axis = {0, 0, 1};
  options.sampling.lowestElevation = -60;
  const Scan scan = scanOf(shape("plane:width=40,height=40"), options);
  double offRay = 0;
  const std::vector<double> errors = rangeErrors(scan, offRay);
  EXPECT_LT(offRay, 1e-12);
  std::vector<double> ranges;
  for (const Vector3d& x : scan.clean.positions)
    ranges.push_back((x - scan.sensors[0]).norm());
  // Standard error of a deviation from 500 or more: 3.2 %.
  for (const double range : {1.2, 2.4, 5., 10.})
    EXPECT_NEAR(rmsWhere(errors, ranges, .7 * range, 1.3 * range) / .02, 1, .1) << range;
}

TEST(ScanDevices, StructuredLightErrsWithTheAngleAndLosesEdges)
{
  ScanOptions options = optionsOf(Device::structuredLight, 20000, {0, 0, 1}, {2, 0, -1});
  options.noise = {.001, Length::Unit::cloud};
  const Scan scan = scanOf(shape("plane:width=40,height=40"), options);
  double offRay = 0;
  const std::vector<double> errors = rangeErrors(scan, offRay);
  std::vector<double> cosines;
  for (const Vector3d& x : scan.clean.positions)
    cosines.push_back((options.sensors[0] - x).normalized().z());
  for (const double cosine : {.2, .35, .6})
    EXPECT_NEAR(rmsWhere(errors, cosines, .9 * cosine, 1.1 * cosine) / (.001 / cosine), 1, .1) << cosine;

  options = optionsOf(Device::structuredLight, 20000, {0, 0, 2}, {0, 0, -1});
  const auto closestToEdge = [&] {
    double closest = 1;
    for (const Vector3d& x : scanOf(screenBeforeWall(), options).clean.positions)
      if (x.z() > -1)
        closest = std::min(closest, .5 - x.head<2>().lpNorm<Eigen::Infinity>());
    return closest;
  };
  // Rays reach .97 of the footprint's radius, 6.9 mm at this distance, one of eight of them to each side or nearly so.
  EXPECT_GT(closestToEdge(), .5 * .0069);
  options.device = Device::none;
  EXPECT_LT(closestToEdge(), .002);
}

TEST(ScanDevices, PhotogrammetryMakesBumpsAndLacksTexture)
{
  ScanOptions options = optionsOf(Device::photogrammetry, 20000, {0, 0, 40}, {0, 0, -1});
  options.clusteredOutliers = 0;
  options.noise = {1, Length::Unit::spacings};
  const Scan scan = scanOf(shape("plane:width=20,height=20"), options);
  // Some 90 × 90 spacings are independent in 60 patches or more: a standard error of √(.09/60) = .04.
  EXPECT_NEAR(static_cast<double>(scan.clean.size()) / 20000, .9, .1);
  std::vector<double> errors;
  std::vector<Vector3d> places;
  for (std::size_t i = 0; i < scan.clean.size(); ++i) {
    errors.push_back(scan.cloud.positions[i].z() / scan.spacing);
    places.push_back(scan.clean.positions[i] / scan.spacing);
    ASSERT_LT((scan.cloud.positions[i] - scan.clean.positions[i]).head<2>().norm(), 1e-12);
  }
  EXPECT_NEAR(rootMeanSquare(errors), std::sqrt(1 + 1. / 16), .15);
  // (½ exp(−½ (d/4)²) + ½ exp(−½ (d/12)²)) / (1 + 1/16): .86 at 2 spacings, .43 at 8.
  EXPECT_NEAR(correlation(places, errors, 1.5, 2.5), .88, .06);
  EXPECT_NEAR(correlation(places, errors, 7.5, 8.5), .44, .12);
}

TEST(ScanDevices, TruthIsTheShapeItself)
{
  for (const std::string description : {"sphere", "box:rounding=.2", "table", "room", "person", "facade", "tubes"}) {
    const AnalyticSurface surface = shape(description);
    const Triangles truth = surface.triangulate();
    const double diagonal = surface.boundingBox().diagonal().norm();
    double area = 0, turned = 0, off = 0;
    for (const auto& [a, b, c] : truth.triangles) {
      const Vector3d &x = truth.vertices[a], middle = (x + truth.vertices[b] + truth.vertices[c]) / 3;
      const Vector3d doubleArea = (truth.vertices[b] - x).cross(truth.vertices[c] - x);
      area += .5 * doubleArea.norm();
      off += std::abs(surface.distance()(middle)) > 3e-4 * diagonal ? .5 * doubleArea.norm() : 0;
      turned += shapes::normalOf(surface.distance(), middle).dot(doubleArea) < 0 ? .5 * doubleArea.norm() : 0;
    }
    // Below the feet of thin bars.
    EXPECT_LT(off, .002 * area) << description;
    EXPECT_LT(turned, .005 * area) << description;
    // The estimate's standard error is 1.6 % at most, with 4,096 draws of those that are seen.
    EXPECT_NEAR(area / scanOf(surface, unseen(100)).visibleArea, 1, .06) << description;
  }
  double volume = 0;
  const Triangles sphere = shape("sphere").triangulate();
  for (const auto& [a, b, c] : sphere.triangles)
    volume += sphere.vertices[a].dot(sphere.vertices[b].cross(sphere.vertices[c])) / 6;
  EXPECT_NEAR(volume / (4 * M_PI / 3), 1, 2e-3);
}

TEST(ScanDevices, NormalsAreEstimatedFromWhatWasMeasured)
{
  ScanOptions options;
  options.sampling.points = 5000;
  options.areNormalsEstimated = true;
  options.views.count = 6;
  const Scan scan = scanOf(shape("sphere"), options);
  std::vector<double> angles;
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    ASSERT_GE(scan.cloud.normals[i].dot(scan.sensors[scan.cloud.views[i]] - scan.cloud.positions[i]), 0);
    angles.push_back(std::acos(std::min(1., scan.cloud.normals[i].dot(scan.clean.normals[i]))));
  }
  std::sort(angles.begin(), angles.end());
  EXPECT_LT(angles[angles.size() / 2], .02);
  EXPECT_GT(angles[angles.size() / 2], 1e-6) << "they are not the exact ones";
}

TEST(ScanDevices, AnyThreadsAndOneSeedGiveTheSameBytes)
{
  const AnalyticSurface table = shape("table");
  for (const Device device : {Device::depthCamera, Device::lidar, Device::structuredLight, Device::photogrammetry}) {
    ScanOptions options = optionsOf(device, 3000, {.2, .6, 2.5}, {0, 0, -1});
    const Scan first = scanOf(table, options, 1), again = scanOf(table, options, 3);
    EXPECT_EQ(first.cloud.positions, again.cloud.positions);
    EXPECT_EQ(first.clean.positions, again.clean.positions);
    EXPECT_EQ(first.outliers, again.outliers);
    options.seed = 2;
    EXPECT_NE(first.cloud.positions, scanOf(table, options, 1).cloud.positions);
    for (const Vector3d& x : first.clean.positions)
      ASSERT_LT(std::abs(table.distance()(x)), 1e-8);
  }
}

TEST(ScanDevices, HolesAndRotationsHoldForAllThatIsMeasured)
{
  const MeshSurface surface = screenBeforeWall();
  ScanOptions options = optionsOf(Device::lidar, 10000, {0, 0, 2}, {0, 0, -1});
  options.noise = {};
  options.sampling.lowestElevation = -15;
  options.sampling.highestElevation = 15;
  options.rotation = {0, 0, 90};
  options.holeCenters = {{.5, 0, 0}};
  options.smallestHole = options.largestHole = {.3, Length::Unit::cloud};
  const Scan scan = scanOf(surface, options);
  ASSERT_GT(scan.outliers, 0);
  ASSERT_GT(scan.heldOut.size(), 0u);
  for (const Vector3d& x : scan.cloud.positions)
    ASSERT_GE((x - Vector3d(.5, 0, 0)).norm(), .3);
}
