// SPDX-License-Identifier: BSD-3-Clause
// The scanner simulator: sampling, visibility, errors, holes, determinism, devices.

#include "scan/analytic_surface.h"
#include "scan/error_model.h"
#include "scan/mesh_surface.h"
#include "scan/random.h"
#include "scan/scan.h"
#include "support/shapes.h"

#include <pcl/surface/mrf/exceptions.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

using namespace pcl::mrf;
using namespace pcl::mrf::scan;
using Eigen::Vector3d;

namespace {

void addQuad(Triangles& soup, const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d)
{
  const auto first = static_cast<std::int32_t>(soup.vertices.size());
  soup.vertices.insert(soup.vertices.end(), {a, b, c, d});
  soup.triangles.push_back({first, first + 1, first + 2});
  soup.triangles.push_back({first, first + 2, first + 3});
}

AnalyticSurface shape(const std::string& description)
{
  return AnalyticSurface(makeShape(description));
}

Scan scanOf(const Surface& surface, const ScanOptions& options, int threads = 1)
{
  Execution execution(threads);
  return simulateScan(surface, options, execution);
}

/// Options that sample the whole surface, without sensors.
ScanOptions unseen(std::int64_t points)
{
  ScanOptions options;
  options.sampling.points = points;
  options.views.count = 0;
  return options;
}

MeshSurface surfaceOf(const Triangles& soup)
{
  return {soup.vertices, soup.triangles};
}

/// The minimum distance between points whose normals have a cosine above this.
double closestOf(const Points& points, double cosine)
{
  double closest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (points.normals[i].dot(points.normals[j]) > cosine)
        closest = std::min(closest, (points.positions[i] - points.positions[j]).norm());
  return closest;
}

/// Expects the same bytes, but for zeros' signs.
void expectSame(const Scan& a, const Scan& b)
{
  for (const auto part : {&Scan::cloud, &Scan::clean, &Scan::heldOut}) {
    EXPECT_EQ((a.*part).positions, (b.*part).positions);
    EXPECT_EQ((a.*part).normals, (b.*part).normals);
    EXPECT_EQ((a.*part).views, (b.*part).views);
  }
  EXPECT_EQ(a.sensors, b.sensors);
  EXPECT_EQ(a.spacing, b.spacing);
  EXPECT_EQ(a.outliers, b.outliers);
}

using Corners = std::array<std::int32_t, 3>;

const std::vector<std::string> allShapes = {
    "sphere:radius=3", "cut-sphere", "torus",          "box",        "box:rounding=.2", "box:x=1,y=1,z=1,rounding=.5",
    "plane",           "tubes",      "tubes:closed=1", "primitives", "cheese",          "table",
    "terrain",         "street",     "room",           "person",     "facade"};

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
  Triangles soup;
  addQuad(soup, {-.5, -.5, 0}, {.5, -.5, 0}, {.5, .5, 0}, {-.5, .5, 0});
  addQuad(soup, {-20, -20, -2}, {20, -20, -2}, {20, 20, -2}, {-20, 20, -2});
  return surfaceOf(soup);
}

/// The error of the range of each point of a scan without outliers. \pre one sensor
/// \param offRay maximum distance from the ray, divided by the range
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

/// The RMS of the values whose key is in a range.
double rmsWhere(const std::vector<double>& values, const std::vector<double>& keys, double lower, double upper)
{
  std::vector<double> some;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (keys[i] >= lower && keys[i] < upper)
      some.push_back(values[i]);
  EXPECT_GT(some.size(), 500u);
  return rootMeanSquare(some);
}

/// The correlation of values at places whose distance is in a range, over a sample of pairs.
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

TEST(ScanSampling, EvenPerAreaOnMeshes)
{
  // One triangle pair has nine times the area of the other, cut into two triangles of different size each.
  Triangles soup;
  addQuad(soup, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  addQuad(soup, {5, 0, 0}, {8, 0, 0}, {8, 3, 0}, {5, 3, 0});
  for (const Pattern pattern : {Pattern::random, Pattern::even}) {
    ScanOptions options = unseen(20000);
    options.sampling.pattern = pattern;
    const bool isEven = pattern == Pattern::even;
    const Scan result = scanOf(surfaceOf(soup), options);
    const auto small = std::count_if(result.cloud.positions.begin(), result.cloud.positions.end(),
                                     [](const Vector3d& x) { return x.x() < 2; });
    // Binomial: σ = √(20000 · .1 · .9) = 42; even sampling is closer, up to the rim, where it is slightly denser.
    EXPECT_NEAR(static_cast<double>(small), 2000, 4 * 42.5) << isEven;
    int quadrant = 0;
    for (const Vector3d& x : result.cloud.positions)
      quadrant += x.x() > 6.5 && x.y() > 1.5 ? 1 : 0;
    EXPECT_NEAR(quadrant, .25 * .9 * 20000, 4 * std::sqrt(20000 * .225 * .775)) << isEven;
  }
}

TEST(ScanSampling, EvenKeepsPointsApart)
{
  ScanOptions options = unseen(4000);
  const AnalyticSurface sphere = shape("sphere");
  const Scan even = scanOf(sphere, options);
  options.sampling.pattern = Pattern::random;
  const Scan random = scanOf(sphere, options);
  const double side = std::sqrt(4 * M_PI / 4000);
  // Poisson process: mean nearest distance is half of the mean side. The estimate's standard error is .26/√4000.
  EXPECT_NEAR(random.spacing / side, .5, .02);
  EXPECT_GT(even.spacing / side, .72);
  EXPECT_GT(closestOf(even.cloud, -2), .6 * side);
}

TEST(ScanSampling, SidesOfAThinPlateDoNotCrowdEachOther)
{
  // Thinner than the distance that points keep (.7 of .045): each side must still keep it, as if it were alone.
  const Scan result = scanOf(shape("box:x=2,y=2,z=.001"), unseen(4000));
  const double side = std::sqrt(result.visibleArea / 4000);
  EXPECT_GT(closestOf(result.cloud, .5), .6 * side);
  const auto top = std::count_if(result.cloud.normals.begin(), result.cloud.normals.end(),
                                 [](const Vector3d& normal) { return normal.z() > .5; });
  EXPECT_NEAR(static_cast<double>(top), 2000, 4 * std::sqrt(1000));
}

TEST(ScanScanner, RaysOfACameraFallOnARegularGrid)
{
  // A wall that the sensor looks at squarely. In tangents of azimuth and elevation its rays are known: rows of equal
  // elevation, columns of equal azimuth.
  Triangles soup;
  addQuad(soup, {-10, -10, 0}, {10, -10, 0}, {10, 10, 0}, {-10, 10, 0});
  ScanOptions options;
  options.sampling.points = 5000;
  options.sampling.pattern = Pattern::scanner;
  options.sampling.aspect = 4;
  options.sensors = {{0, 0, 20}};
  const Scan result = scanOf(surfaceOf(soup), options);
  EXPECT_NEAR(static_cast<double>(result.cloud.size()), 5000, 150) << "one of some 35 rows more or less";
  std::vector<double> azimuths, elevations;
  for (const Vector3d& x : result.cloud.positions) {
    ASSERT_NEAR(x.z(), 0, 1e-12);
    // The sensor looks along -z, so that its left is +x.
    azimuths.push_back(std::atan2(x.x(), 20));
    elevations.push_back(std::atan2(x.y(), std::hypot(x.x(), 20)));
  }
  const auto step = [](std::vector<double> angles) {
    std::sort(angles.begin(), angles.end());
    double least = 1, most = 0;
    int number = 1;
    for (std::size_t i = 1; i < angles.size(); ++i)
      if (const double gap = angles[i] - angles[i - 1]; gap > 1e-9) {
        least = std::min(least, gap);
        most = std::max(most, gap);
        ++number;
      }
    // Rounding of the positions is 2e-15 of 20.
    EXPECT_NEAR(least, most, 1e-12) << number << " rows or columns";
    return least;
  };
  EXPECT_NEAR(step(elevations) / step(azimuths), 4, 1e-9);
}

TEST(ScanScanner, DensityFallsWithDistanceAndAngle)
{
  // Two squares that face the sensor, one of them three times as far and out of the other's shadow, and a third one
  // as close as the first that is turned by 60 degrees: points per area go as cos / distance².
  Triangles soup;
  const double h = .2;
  addQuad(soup, {-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0});
  addQuad(soup, {-h, 3 - h, -20}, {h, 3 - h, -20}, {h, 3 + h, -20}, {-h, 3 + h, -20});
  const double across = .5 * h, deep = std::sqrt(.75) * h;
  addQuad(soup, {-1 - across, -h, -deep}, {-1 + across, -h, deep}, {-1 + across, h, deep}, {-1 - across, h, -deep});
  ScanOptions options;
  options.sampling.points = 20000;
  options.sampling.pattern = Pattern::scanner;
  options.sensors = {{0, 0, 10}};
  const Scan result = scanOf(surfaceOf(soup), options);
  double near = 0, far = 0, turned = 0;
  for (const Vector3d& x : result.cloud.positions)
    (x.z() < -10 ? far : x.x() < -.5 ? turned : near) += 1;
  // The grid's azimuth is finer by the cosine of the elevation, 6 degrees at most; the row of points along each of a
  // square's sides may or may not be hit: with 1,000 points a side of 32 in each of four.
  EXPECT_NEAR(far / near, 1. / 9, .012);
  // The turned one is 10.05 away and seen under 60 + 5.7 degrees, less at its nearer side.
  EXPECT_NEAR(turned / near, .5 - .0866, .02);
}

TEST(ScanScanner, HitsAreTheFirstOfTheirRays)
{
  for (const std::string description : {"cheese", "table", "terrain:side=10", "tubes", "cut-sphere:angle=120"}) {
    SCOPED_TRACE(description);
    const AnalyticSurface surface = shape(description);
    const Box box = surface.boundingBox();
    ScanOptions options;
    options.sampling.points = 1500;
    options.sampling.pattern = Pattern::scanner;
    options.sensors = {box.center() + box.diagonal().norm() * Vector3d(.2, .4, 1.5)};
    const Scan result = scanOf(surface, options);
    ASSERT_GT(result.cloud.size(), 1000u);
    EXPECT_GT(result.spacing, 0);
    for (std::size_t i = 0; i < result.cloud.size(); ++i) {
      const Vector3d &x = result.cloud.positions[i], sight = options.sensors[0] - x;
      ASSERT_LT(std::abs(surface.distance()(x)), 1e-9 * box.diagonal().norm());
      ASSERT_GE(result.cloud.normals[i].dot(sight.normalized()), std::cos(80 * M_PI / 180) - 1e-9);
      for (int step = 1; step < 100; ++step)
        ASSERT_GT(surface.distance()(x + step / 100.0 * sight), 0);
    }
  }
}

TEST(ScanViews, SensorsWhereAsked)
{
  const Box box(Vector3d(1, 2, 3), Vector3d(3, 4, 4));
  ViewOptions options;
  options.distance = 2;
  for (const Placement placement : {Placement::sphere, Placement::ring, Placement::front}) {
    options.placement = placement;
    options.count = 40;
    const auto sensors = placeSensors(options, box);
    ASSERT_EQ(sensors.size(), 40u);
    Vector3d mean = Vector3d::Zero();
    for (const Vector3d& sensor : sensors) {
      EXPECT_NEAR((sensor - box.center()).norm(), 2 * 3, 1e-9);
      mean += (sensor - box.center()) / 40;
      if (placement != Placement::sphere) {
        EXPECT_NEAR(sensor.y(), box.center().y(), 1e-9);
      }
      if (placement == Placement::front) { // half of 90 degrees to either side of +z
        EXPECT_GE((sensor - box.center()).z(), 6 * std::sqrt(.5) - 1e-9);
      }
    }
    if (placement != Placement::front) {
      EXPECT_LT(mean.norm(), .1 * 6) << "not even";
    }
  }
}

TEST(ScanViews, EverySensorSeesItsPoints)
{
  for (const std::string description : {"sphere", "primitives", "cheese", "cut-sphere"}) {
    ScanOptions options;
    options.sampling.points = 2500;
    options.sampling.grazingLimit = 70;
    options.misalignmentAngle = 1;
    options.misalignmentShift = {1, Length::Unit::diagonalPercent};
    const Scan result = scanOf(shape(description), options);
    ASSERT_EQ(result.sensors.size(), 12u);
    ASSERT_EQ(result.cloud.views.size(), 2500u);
    std::vector<int> used(12, 0);
    for (std::size_t i = 0; i < 2500; ++i) {
      const auto view = static_cast<std::size_t>(result.cloud.views[i]);
      ASSERT_LT(view, 12u);
      ++used[view];
      const Vector3d sight = result.sensors[view] - result.cloud.positions[i];
      // A view and its sensor move as one: the limit holds after misalignment, up to rounding.
      ASSERT_GE(result.cloud.normals[i].dot(sight.normalized()), std::cos(70 * M_PI / 180) - 1e-9) << description;
    }
    if (description == "sphere") {
      EXPECT_GT(*std::min_element(used.begin(), used.end()), 100);
    }
  }
}

TEST(ScanViews, SolidsHideEachOther)
{
  // Closed tubes in line, looked at from beyond one end: the other tube is in its shadow.
  ScanOptions options;
  options.sampling.points = 2000;
  options.sensors = {{100, 0, 0}};
  for (const Vector3d& x : scanOf(shape("tubes:closed=1"), options).cloud.positions)
    ASSERT_GT(x.x(), 1.24);
}

TEST(ScanNoise, SigmaIsWhatWasAsked)
{
  const AnalyticSurface sphere = shape("sphere:radius=10");
  ScanOptions options = unseen(20000);
  const Scan clean = scanOf(sphere, options);
  for (const Length sigma : {Length{.05, Length::Unit::cloud}, Length{.2, Length::Unit::diagonalPercent},
                             Length{.5, Length::Unit::spacings}}) {
    options.noise = sigma;
    const Scan result = scanOf(sphere, options);
    ASSERT_EQ(result.clean.positions, clean.cloud.positions) << "noise must not move the true points";
    const double expected = sigma.unit == Length::Unit::cloud             ? .05
                            : sigma.unit == Length::Unit::diagonalPercent ? .002 * 20 * std::sqrt(3)
                                                                          : .5 * clean.spacing;
    std::vector<double> along;
    for (std::size_t i = 0; i < 20000; ++i) {
      const Vector3d moved = result.cloud.positions[i] - result.clean.positions[i], n = result.clean.normals[i];
      along.push_back(moved.dot(n));
      ASSERT_LT((moved - along.back() * n).norm(), 1e-12);
    }
    // Standard error of a standard deviation: σ/√(2n) = σ/200; three of them.
    EXPECT_NEAR(rootMeanSquare(along) / expected, 1, .015);
  }
}

TEST(ScanNoise, ViewsMoveAsRigidBodies)
{
  ScanOptions options;
  options.sampling.points = 3000;
  options.views.count = 200;
  options.misalignmentShift = {.1, Length::Unit::cloud};
  const AnalyticSurface sphere = shape("sphere");
  Scan result = scanOf(sphere, options);
  std::vector<double> shifts;
  std::vector<Vector3d> ofView(200, Vector3d::Constant(NAN));
  for (std::size_t i = 0; i < result.cloud.size(); ++i) {
    const Vector3d moved = result.cloud.positions[i] - result.clean.positions[i];
    Vector3d& first = ofView[result.cloud.views[i]];
    if (std::isnan(first.x()))
      first = moved;
    ASSERT_LT((moved - first).norm(), 1e-12);
  }
  for (const Vector3d& shift : ofView)
    if (!std::isnan(shift.x()))
      for (int axis = 0; axis < 3; ++axis)
        shifts.push_back(shift[axis]);
  ASSERT_GT(shifts.size(), 500u);
  EXPECT_NEAR(rootMeanSquare(shifts), .1, 4 * .1 / std::sqrt(2.0 * 500));

  options.misalignmentShift = {};
  options.misalignmentAngle = 2;
  result = scanOf(sphere, options);
  for (std::size_t i = 0; i < result.cloud.size(); ++i) {
    // About the middle: a sphere stays where it is, and its normals stay its normals.
    ASSERT_NEAR(result.cloud.positions[i].norm(), 1, 1e-12);
    ASSERT_LT((result.cloud.positions[i] - result.cloud.normals[i]).norm(), 1e-12);
  }
  EXPECT_GT((result.cloud.positions[0] - result.clean.positions[0]).norm(), 1e-4);
}

TEST(ScanOutliers, SharesAreExact)
{
  ScanOptions options;
  options.sampling.points = 9000;
  options.uniformOutliers = 4;
  options.clusteredOutliers = 6;
  const AnalyticSurface sphere = shape("sphere");
  const Scan result = scanOf(sphere, options);
  EXPECT_EQ(result.outliers, 1000);
  EXPECT_EQ(result.cloud.size(), 10000u);
  EXPECT_EQ(result.clean.size(), 9000u);
  std::vector<Vector3d> off;
  int late = 0;
  for (std::size_t i = 0; i < result.cloud.size(); ++i) {
    const Vector3d& x = result.cloud.positions[i];
    const Vector3d sight = result.sensors[result.cloud.views[i]] - x;
    ASSERT_GE(result.cloud.normals[i].dot(sight), 0);
    if (std::abs(x.norm() - 1) > 1e-9) {
      off.push_back(x);
      late += i >= 9000 ? 1 : 0;
    }
  }
  ASSERT_EQ(off.size(), 1000u);
  EXPECT_NEAR(late, 100, 4 * std::sqrt(90)) << "the last tenth of the cloud has a tenth of the outliers";
  // Members of a cluster have 10 others within 3 cluster radii (1 % of 3.46); 400 points in a box of 13 have not.
  int crowded = 0;
  for (const Vector3d& x : off) {
    const auto near =
        std::count_if(off.begin(), off.end(), [&](const Vector3d& y) { return (x - y).norm() < 3 * .0346; });
    crowded += near > 10 ? 1 : 0;
  }
  EXPECT_NEAR(crowded, 600, 25);
}

TEST(ScanHoles, EmptyInsideAndHeldOutPointsInThem)
{
  const AnalyticSurface torus = shape("torus");
  ScanOptions options;
  options.sampling.points = 8000;
  const Scan whole = scanOf(torus, options);
  options.holes = 4;
  options.smallestHole = {4, Length::Unit::diagonalPercent};
  options.largestHole = {8, Length::Unit::diagonalPercent};
  options.holeCenters = {{1.4, 0, 0}};
  options.uniformOutliers = 5;
  const Scan result = scanOf(torus, options);
  ASSERT_EQ(result.holes.size(), 5u);
  EXPECT_EQ(result.heldOut.size() + result.clean.size(), 8000u);
  const auto holeOf = [&](const Vector3d& x) {
    return std::find_if(result.holes.begin(), result.holes.end(),
                        [&](const Hole& hole) { return (x - hole.center).norm() < hole.radius; }) != result.holes.end();
  };
  for (const Vector3d& x : result.cloud.positions)
    ASSERT_FALSE(holeOf(x));
  std::int64_t taken = 0;
  for (const Vector3d& x : result.heldOut.positions) {
    ASSERT_TRUE(holeOf(x));
    ASSERT_LT(std::abs(torus.distance()(x)), 1e-9);
  }
  EXPECT_EQ(result.holes[0].center, Vector3d(1.4, 0, 0));
  for (std::size_t i = 0; i < 5; ++i) {
    const Hole& hole = result.holes[i];
    taken += hole.points;
    EXPECT_GT(hole.points, 0);
    EXPECT_GE(hole.radius, .04 * result.diagonal * (1 - 1e-12));
    EXPECT_LE(hole.radius, .08 * result.diagonal * (1 + 1e-12));
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GE((hole.center - result.holes[j].center).norm(), hole.radius + result.holes[j].radius);
  }
  EXPECT_EQ(taken, static_cast<std::int64_t>(result.heldOut.size())) << "holes do not overlap";
}

TEST(ScanDeterminism, SeedDecidesAllAndThreadsNothing)
{
  ScanOptions errors;
  errors.noise = {.5, Length::Unit::spacings};
  errors.misalignmentAngle = .5;
  errors.uniformOutliers = 1;
  errors.clusteredOutliers = 2;
  errors.holes = 2;
  std::vector<ScanOptions> all;
  for (const Pattern pattern : {Pattern::even, Pattern::random, Pattern::scanner}) {
    all.push_back(errors);
    all.back().sampling.pattern = pattern;
  }
  for (const Device device : {Device::depthCamera, Device::lidar, Device::structuredLight, Device::photogrammetry}) {
    adopt(device, all.emplace_back());
    all.back().sensors = {{.2, .6, 2.5}};
  }
  const AnalyticSurface table = shape("table");
  for (ScanOptions& options : all) {
    options.sampling.points = 3000;
    const Scan first = scanOf(table, options, 1);
    expectSame(first, scanOf(table, options, 3));
    options.seed = 2;
    EXPECT_NE(first.cloud.positions, scanOf(table, options, 1).cloud.positions);
    for (const Vector3d& x : first.clean.positions)
      ASSERT_LT(std::abs(table.distance()(x)), 1e-8);
  }
}

TEST(ScanRotation, RotatesTheSample)
{
  ScanOptions options = unseen(1000);
  const AnalyticSurface cap = shape("cut-sphere");
  const Scan still = scanOf(cap, options);
  options.rotation = {0, 30, 0};
  const Scan turned = scanOf(cap, options);
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(M_PI / 6, Vector3d::UnitY()).toRotationMatrix();
  for (std::size_t i = 0; i < 1000; ++i) {
    ASSERT_LT((turned.cloud.positions[i] - rotation * still.cloud.positions[i]).norm(), 1e-12 * 40);
    ASSERT_LT((turned.cloud.normals[i] - rotation * still.cloud.normals[i]).norm(), 1e-12);
  }
  EXPECT_EQ(turned.diagonal, still.diagonal);

  // Sensors stay in the cloud's frame: from the front, a box turned by 180 degrees shows its other side.
  options.views.count = 1;
  options.views.placement = Placement::front;
  options.rotation = {0, 180, 0};
  const AnalyticSurface box = shape("box");
  const Scan back = scanOf(box, options);
  for (std::size_t i = 0; i < back.cloud.size(); ++i) {
    ASSERT_GT(back.cloud.normals[i].dot(back.sensors[0] - back.cloud.positions[i]), 0);
    ASSERT_GT(back.cloud.positions[i].z(), 0);
  }
}

TEST(ScanErrors, Lengths)
{
  Length length;
  for (const auto& [text, value, unit] : {std::tuple("0.25%", .25, Length::Unit::diagonalPercent),
                                          {"2s", 2., Length::Unit::spacings},
                                          {"1e-3", 1e-3, Length::Unit::cloud}}) {
    EXPECT_TRUE(parseLength(text, length));
    EXPECT_EQ(length.value, value);
    EXPECT_EQ(length.unit, unit);
  }
  for (const char* text : {"", "%", "-1", "1 %", "nan", "inf", "1m", "1%%"})
    EXPECT_FALSE(parseLength(text, length)) << text;
}

// The scanned surfaces: shapes, meshes, lines of sight, random numbers.

TEST(ScanRandom, MomentsEvennessAndStreams)
{
  Random random(7, 3);
  const int count = 200000;
  double mean = 0, square = 0, fourth = 0;
  for (int i = 0; i < count; ++i) {
    const double x = random.normal();
    mean += x / count;
    square += x * x / count;
    fourth += x * x * x * x / count;
  }
  // Four standard errors: 1/√n, √2/√n, √96/√n.
  const double error = 4 / std::sqrt(count);
  EXPECT_NEAR(mean, 0, error);
  EXPECT_NEAR(square, 1, error * std::sqrt(2));
  EXPECT_NEAR(fourth, 3, error * std::sqrt(96));

  std::array<int, 7> histogram{};
  for (int i = 0; i < 70000; ++i)
    ++histogram[random.index(7)];
  for (const int entries : histogram)
    EXPECT_NEAR(entries, 10000, 4 * std::sqrt(10000 * 6 / 7.0));

  Vector3d sum = Vector3d::Zero();
  for (int i = 0; i < 10000; ++i)
    sum += random.direction();
  EXPECT_LT(sum.norm() / 10000, 4 / std::sqrt(10000));

  Random a(1, 1), b(1, 2), c(2, 1), again(1, 1);
  const std::uint64_t first = a.bits();
  EXPECT_NE(first, b.bits());
  EXPECT_NE(first, c.bits());
  EXPECT_EQ(first, again.bits());
}

TEST(ScanMesh, RaysAgreeWithTryingAllTriangles)
{
  // Small random triangles of any orientation; some of them needles.
  Random random(5, 1);
  Triangles soup;
  for (std::int32_t i = 0; i < 600; ++i) {
    const Vector3d center(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    for (int corner = 0; corner < 3; ++corner)
      soup.vertices.push_back(center + .15 * random.normalVector());
    soup.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const MeshSurface surface = surfaceOf(soup);
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    SurfacePoint start, hit;
    start.position = 2 * random.direction();
    start.part = -1;
    const Vector3d end = 2 * random.direction(), direction = (end - start.position).normalized();
    // Independent of the surface's test: signed volumes of the segment with the triangle's edges.
    double first = INFINITY;
    for (const Corners& t : soup.triangles) {
      const Vector3d a = soup.vertices[t[0]] - start.position, b = soup.vertices[t[1]] - start.position,
                     c = soup.vertices[t[2]] - start.position;
      const double u = direction.dot(a.cross(b)), v = direction.dot(b.cross(c)), w = direction.dot(c.cross(a));
      if (!((u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0)))
        continue;
      const Vector3d normal = (b - a).cross(c - a);
      if (const double distance = normal.dot(a) / normal.dot(direction); distance > 0)
        first = std::min(first, distance);
    }
    hits += std::isfinite(first) ? 1 : 0;
    ASSERT_EQ(surface.isOccluded(start, end), first < (end - start.position).norm()) << "segment " << i;
    ASSERT_EQ(surface.firstHit(start.position, direction, hit), std::isfinite(first)) << "ray " << i;
    if (std::isfinite(first)) {
      ASSERT_NEAR((hit.position - start.position).norm(), first, 1e-9) << "needles lose some digits";
    }
  }
  EXPECT_GT(hits, 300);
  EXPECT_LT(hits, 2700);
}

TEST(ScanMesh, ManyTrianglesInOnePlace)
{
  Triangles soup;
  for (int i = 0; i < 5000; ++i)
    addQuad(soup, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  const MeshSurface surface = surfaceOf(soup);
  SurfacePoint hit;
  EXPECT_TRUE(surface.firstHit({.3, .4, 1}, {0, 0, -1}, hit));
  EXPECT_LT(hit.part, 2) << "of equals the first";
  EXPECT_FALSE(surface.firstHit({1.3, .4, 1}, {0, 0, -1}, hit));
}

TEST(ScanShapes, PointsAndNormalsAreExact)
{
  for (const std::string& description : allShapes) {
    const AnalyticSurface surface = shape(description);
    const Scan result = scanOf(surface, unseen(2000));
    ASSERT_EQ(result.cloud.size(), 2000u) << description;
    ASSERT_EQ(result.cloud.normals.size(), 2000u);
    EXPECT_TRUE(result.cloud.views.empty());
    const double diagonal = result.diagonal;
    int turned = 0;
    for (std::size_t i = 0; i < result.cloud.size(); ++i) {
      const Vector3d &x = result.cloud.positions[i], &n = result.cloud.normals[i];
      ASSERT_LT(std::abs(surface.distance()(x)), 1e-9 * diagonal) << description;
      ASSERT_NEAR(n.norm(), 1, 1e-12);
      // The gradient is taken over 2e-5, which at an edge or a seam of curvature may straddle it.
      turned += shapes::normalOf(surface.distance(), x).dot(n) < 1 - 1e-6 ? 1 : 0;
      const Box box = surface.boundingBox();
      ASSERT_GE((x - box.min()).minCoeff(), -1e-9 * diagonal) << description;
      ASSERT_GE((box.max() - x).minCoeff(), -1e-9 * diagonal) << description;
    }
    EXPECT_LE(turned, 2) << description;
  }
}

TEST(ScanShapes, AreasMatchTheFormulas)
{
  const auto area = [](const std::string& description) { return scanOf(shape(description), unseen(100)).visibleArea; };
  // The estimate counts 16384 draws or more: below 1.2 % standard error, so 4 % is beyond three of them.
  EXPECT_NEAR(area("torus:major=2,minor=.5") / (4 * M_PI * M_PI), 1, .04);
  EXPECT_NEAR(area("cut-sphere:radius=40,angle=37") / (2 * M_PI * 1600 * (1 - std::cos(37 * M_PI / 180))), 1, 1e-9);
  EXPECT_NEAR(area("box:x=2,y=3,z=4") / 52, 1, 1e-9);
  EXPECT_NEAR(area("tubes:radius=1,length=2,gap=1") / (8 * M_PI), 1, 1e-9);
  const double r = .25, x = 2 - 2 * r, y = 1.5 - 2 * r, z = 1 - 2 * r;
  const double rounded = 2 * (x * y + y * z + z * x) + 2 * M_PI * r * (x + y + z) + 4 * M_PI * r * r;
  EXPECT_NEAR(area("box:rounding=.25") / rounded, 1, .04);
}

TEST(ScanShapes, WrongDescriptionsAreNamed)
{
  for (const std::string description :
       {"spere", "sphere:radius=0", "sphere:radius=-1", "sphere:radius=x", "sphere:radius", "sphere:size=1",
        "sphere:radius=nan", "torus:minor=2", "box:rounding=.6", "cheese:bubbles=1.5", "cut-sphere:angle=0"})
    EXPECT_THROW(makeShape(description), InvalidOption) << description;
}

// The devices: each has its documented errors.

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
