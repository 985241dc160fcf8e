// SPDX-License-Identifier: BSD-3-Clause
// What the scanner simulator scans: shapes, meshes, lines of sight, random numbers.

#include "scan/analytic_surface.h"
#include "scan/mesh_surface.h"
#include "scan/random.h"
#include "scan/scan.h"
#include "support/scan_meshes.h"

#include <pcl/surface/mrf/exceptions.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace pcl::mrf;
using namespace pcl::mrf::scan;
using Eigen::Vector3d;
using scan_meshes::Soup;

namespace {

using Corners = std::array<std::int32_t, 3>;

AnalyticSurface shape(const std::string& description)
{
  return AnalyticSurface(makeShape(description));
}

Scan scanOf(const Surface& surface, const ScanOptions& options)
{
  Execution execution;
  return simulateScan(surface, options, execution);
}

ScanOptions unseen(std::int64_t points)
{
  ScanOptions options;
  options.sampling.points = points;
  options.views.count = 0;
  return options;
}

const std::vector<std::string> allShapes = {
    "sphere:radius=3", "cut-sphere", "torus",          "box",        "box:rounding=.2", "box:x=1,y=1,z=1,rounding=.5",
    "plane",           "tubes",      "tubes:closed=1", "primitives", "plate",           "cheese",
    "table",           "terrain",    "street"};

} // namespace

TEST(ScanRandom, MomentsAndEvenness)
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
}

TEST(ScanRandom, StreamsDiffer)
{
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
  Soup soup;
  for (std::int32_t i = 0; i < 600; ++i) {
    const Vector3d center(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    for (int corner = 0; corner < 3; ++corner)
      soup.vertices.push_back(center + .15 * random.normalVector());
    soup.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const MeshSurface surface(soup.vertices, soup.triangles);
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
  Soup soup;
  for (int i = 0; i < 5000; ++i)
    soup.quad({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  const MeshSurface surface(soup.vertices, soup.triangles);
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
      ASSERT_GE((x - box.lower).minCoeff(), -1e-9 * diagonal) << description;
      ASSERT_GE((box.upper - x).minCoeff(), -1e-9 * diagonal) << description;
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

TEST(ScanShapes, CapEndsAtItsAngle)
{
  const Scan result = scanOf(shape("cut-sphere:radius=40,angle=37"), unseen(3000));
  double lowest = 40;
  for (const Vector3d& x : result.cloud.positions)
    lowest = std::min(lowest, x.z());
  const double edge = 40 * std::cos(37 * M_PI / 180);
  EXPECT_GE(lowest, edge - 1e-9);
  EXPECT_LT(lowest, edge + .1);
}

TEST(ScanShapes, WrongDescriptionsAreNamed)
{
  for (const std::string description :
       {"spere", "sphere:radius=0", "sphere:radius=-1", "sphere:radius=x", "sphere:radius", "sphere:size=1",
        "sphere:radius=nan", "torus:minor=2", "box:rounding=.6", "cheese:bubbles=1.5", "cut-sphere:angle=0"})
    EXPECT_THROW(makeShape(description), InvalidOption) << description;
  try {
    makeShape("torus:mayor=2");
    FAIL();
  } catch (const InvalidOption& error) {
    EXPECT_NE(error.message().find("'mayor'"), std::string::npos);
    EXPECT_NE(error.message().find("major"), std::string::npos);
  }
}

TEST(ScanMesh, RefusesBrokenMeshes)
{
  EXPECT_THROW(MeshSurface({}, {}), InvalidInput);
  EXPECT_THROW(MeshSurface({{0, 0, 0}}, {{0, 1, 2}}), InvalidInput);
  EXPECT_THROW(MeshSurface({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}), InvalidInput) << "no area";
  EXPECT_THROW(MeshSurface({{0, 0, 0}, {1, 0, NAN}, {0, 1, 0}}, {{0, 1, 2}}), InvalidInput);
}
