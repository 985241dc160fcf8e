// SPDX-License-Identifier: BSD-3-Clause
// What the scanner simulator scans: shapes, meshes, lines of sight, and the arithmetic beneath.

#include "scan/analytic_surface.h"
#include "scan/displacement.h"
#include "scan/mesh_surface.h"
#include "scan/scan.h"
#include "support/scan_meshes.h"

#include <pcl/surface/mrf/exceptions.h>
#include <shapes/portable_math.h>

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

TEST(PortableMath, AgreesWithTheLibrary)
{
  for (int i = -2000; i <= 2000; ++i) {
    const double turns = i / 777.0;
    const auto value = portable::sinCos(turns);
    // 1e-15 for the series, and the library's argument 2πt is itself rounded to 16 · 2^-53.
    EXPECT_NEAR(value.sine, std::sin(2 * M_PI * turns), 4e-15);
    EXPECT_NEAR(value.cosine, std::cos(2 * M_PI * turns), 4e-15);
  }
  for (double x = 1e-300; x < 1e300; x *= 1.37)
    EXPECT_NEAR(portable::logarithm(x), std::log(x), 4e-16 * std::max(1.0, std::abs(std::log(x))));
}

TEST(PortableRandom, MomentsAndEvenness)
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

TEST(PortableRandom, StreamsDiffer)
{
  Random a(1, 1), b(1, 2), c(2, 1), again(1, 1);
  const std::uint64_t first = a.bits();
  EXPECT_NE(first, b.bits());
  EXPECT_NE(first, c.bits());
  EXPECT_EQ(first, again.bits());
}

TEST(TriangleTree, AgreesWithTryingAllTriangles)
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
  const TriangleTree tree(soup.vertices, soup.triangles);
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vector3d origin = 2 * random.direction(), direction = 2 * random.direction() - origin;
    // Independent of the tree's test: signed volumes of the segment with the triangle's edges.
    bool isHit = false;
    double first = 1;
    for (const Corners& t : soup.triangles) {
      const Vector3d a = soup.vertices[static_cast<std::size_t>(t[0])] - origin,
                     b = soup.vertices[static_cast<std::size_t>(t[1])] - origin,
                     c = soup.vertices[static_cast<std::size_t>(t[2])] - origin;
      const double u = direction.dot(a.cross(b)), v = direction.dot(b.cross(c)), w = direction.dot(c.cross(a));
      if (!((u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0)))
        continue;
      const Vector3d normal = (b - a).cross(c - a);
      const double t1 = normal.dot(a) / normal.dot(direction);
      isHit = isHit || (t1 > 0 && t1 < 1);
      if (t1 > 0)
        first = std::min(first, t1);
    }
    hits += isHit ? 1 : 0;
    ASSERT_EQ(tree.isHit(origin, direction, 0, -1), isHit) << "segment " << i;
    const TriangleTree::Hit hit = tree.firstHit(origin, direction);
    ASSERT_EQ(hit.triangle >= 0, isHit);
    if (isHit) {
      ASSERT_NEAR(hit.t, first, 1e-9) << "needles lose some digits";
    }
  }
  EXPECT_GT(hits, 300);
  EXPECT_LT(hits, 2700);
}

TEST(TriangleTree, ManyTrianglesInOnePlace)
{
  Soup soup;
  for (int i = 0; i < 5000; ++i)
    soup.quad({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  const TriangleTree tree(soup.vertices, soup.triangles);
  EXPECT_TRUE(tree.isHit({.3, .4, 1}, {0, 0, -2}, 0, -1));
  EXPECT_FALSE(tree.isHit({1.3, .4, 1}, {0, 0, -2}, 0, -1));
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

TEST(ScanDisplacement, HeightAndNormals)
{
  // On a plane the displaced surface is a graph, whose normal follows from the height alone.
  Random random(1, 1);
  const double amplitude = .03, wavelength = .4;
  const Displacement displacement(amplitude, wavelength, random);
  Vector3d gradient, ignored;
  const Vector3d x(.3, -.2, .7);
  displacement.height(x, gradient);
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = 1e-6 * Vector3d::Unit(axis);
    const double slope = (displacement.height(x + step, ignored) - displacement.height(x - step, ignored)) / 2e-6;
    EXPECT_NEAR(slope, gradient[axis], 1e-8); // rounding: 1e-17 / 1e-6; curvature: 1e-12 · 100
  }

  // The normal must be that of the displaced surface itself: compare with close by displaced points of one patch.
  for (const Patch& patch : {spherePatch(1, Vector3d::Zero()), torusPatch(1, .4, Vector3d::Zero()),
                             reversed(cylinderPatch({0, 0, 0}, {0, 0, 2}, .5))})
    for (int i = 0; i < 50; ++i) {
      const double u = random.uniform(.1, .9), v = random.uniform(.1, .9), h = 1e-6;
      const auto displaced = [&](double du, double dv) {
        SurfacePoint point;
        EXPECT_TRUE(patch.at({0, u + du, v + dv, 0, 0}, point));
        point.displacementDirection = point.normal;
        EXPECT_TRUE(displacement.apply(point));
        return point;
      };
      const SurfacePoint center = displaced(0, 0);
      for (const Vector3d& tangent : {Vector3d(displaced(h, 0).position - displaced(-h, 0).position),
                                      Vector3d(displaced(0, h).position - displaced(0, -h).position)})
        EXPECT_NEAR(tangent.normalized().dot(center.normal), 0, 1e-6); // error of the difference: h² and 1e-16/h
    }
}
