// SPDX-License-Identifier: BSD-3-Clause
#include "exact/self_intersections.h"
#include "mesh/crowded_space.h"
#include "mesh/self_intersection.h"
#include "support/cancelling.h"
#include "support/meshes.h"
#include "support/random.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <set>

using namespace meshes;
using namespace pcl::mrf;
using Eigen::Vector3f;

namespace {

bool degenerate(const TriangleMesh& mesh)
{
  return std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const Triangle& t) {
    const Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    return (b - a).cross(c - a).isZero(0);
  });
}

/// Compares pairs of triangles with corners on a tiny integer lattice, where touching, coplanar and overlapping pairs
/// are common and every product is exact.
void comparePairs(const std::vector<Triangle>& triangles, int vertices, unsigned seed)
{
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> coordinate(0, 3);
  int compared = 0, intersecting = 0;
  while (compared < 15000) {
    TriangleMesh mesh;
    std::set<std::array<int, 3>> distinct;
    for (int v = 0; v < vertices; ++v) {
      const std::array<int, 3> p{coordinate(random), coordinate(random), compared % 3 == 0 ? 0 : coordinate(random)};
      distinct.insert(p);
      mesh.vertices.push_back(Eigen::Vector3i(p[0], p[1], p[2]).cast<float>());
    }
    mesh.triangles = triangles;
    // Coincident vertices of different index: a shared corner to the eye, an intersection to both.
    if (degenerate(mesh) || (compared % 2 == 0 && distinct.size() < mesh.vertices.size()))
      continue;
    const auto expected = exact::selfIntersectingTriangles(mesh);
    ASSERT_EQ(selfIntersectingTriangles(mesh), expected)
        << "vertices: " << ::testing::PrintToString(distinct) << ", pair " << compared;
    ++compared;
    intersecting += expected.empty() ? 0 : 1;
  }
  // The comparison says something only if both answers are frequent.
  EXPECT_GT(intersecting, compared / 50);
  EXPECT_LT(intersecting, compared - compared / 50);
}

} // namespace

TEST(SelfIntersection, PairsAgreeWithCgal)
{
  comparePairs({{0, 1, 2}, {3, 4, 5}}, 6, 1);
  comparePairs({{0, 1, 2}, {3, 0, 4}}, 5, 2); // with a common vertex
  comparePairs({{0, 1, 2}, {1, 0, 3}}, 4, 3); // with a common edge
}

TEST(SelfIntersection, CrumpledPatchAgreesWithCgal)
{
  std::mt19937 random(4);
  for (const float noise : {.4f, .8f, 1.5f}) {
    TriangleMesh mesh = squares(30);
    std::normal_distribution<float> offset(0, noise);
    for (Vector3f& p : mesh.vertices)
      p += Vector3f(offset(random), offset(random), offset(random));
    const auto expected = exact::selfIntersectingTriangles(mesh);
    EXPECT_FALSE(expected.empty());
    EXPECT_EQ(selfIntersectingTriangles(mesh), expected);
  }
}

TEST(SelfIntersection, NearlyFlatPatchFarFromTheOriginAgreesWithCgal)
{
  // Rounding to float leaves a tilted plane almost, but not exactly flat: the filter alone would guess.
  TriangleMesh mesh = squares(20);
  for (Vector3f& p : mesh.vertices)
    p = Vector3f(1000 + .37f * p.x(), 2000 + .21f * p.y(), 3000 + .1f * p.x() + .3f * p.y());
  append(mesh, mesh, {.05f, .02f, 0});
  EXPECT_EQ(selfIntersectingTriangles(mesh), exact::selfIntersectingTriangles(mesh));
}

TEST(SelfIntersection, SlicedSpheresAgreeWithCgalForAnyNumberOfThreads)
{
  TriangleMesh mesh = zeroLevel(shapes::field(shapes::sphere(.7), 1, 20));
  EXPECT_TRUE(selfIntersectingTriangles(mesh).empty());
  append(mesh, mesh, {.5f, .13f, .21f});
  const auto expected = exact::selfIntersectingTriangles(mesh);
  EXPECT_GT(expected.size(), 50u);
  for (const int threads : {1, 2, 4}) {
    Execution execution(threads);
    EXPECT_EQ(selfIntersectingTriangles(mesh, execution), expected);
  }
}

TEST(SelfIntersection, OnlyPairsWithAMarkedTriangleAreLookedAt)
{
  std::mt19937 random(5);
  TriangleMesh mesh = squares(20);
  std::normal_distribution<float> offset(0, .6f);
  for (Vector3f& p : mesh.vertices)
    p += Vector3f(offset(random), offset(random), offset(random));
  std::vector<std::uint8_t> marked(mesh.triangles.size(), 0);
  for (std::uint8_t& flag : marked)
    flag = random() % 4 == 0 ? 1 : 0;
  Execution execution(2);
  const std::vector<std::int32_t> found = selfIntersectingTriangles(mesh, execution, marked);
  // A triangle alone against all others tells whether it intersects a marked one.
  std::vector<std::int32_t> expected;
  for (std::size_t t = 0; t < marked.size(); ++t) {
    TriangleMesh others;
    others.vertices = mesh.vertices;
    others.triangles = {mesh.triangles[t]};
    for (std::size_t s = 0; s < marked.size(); ++s)
      if (s != t && (marked[s] != 0 || marked[t] != 0))
        others.triangles.push_back(mesh.triangles[s]);
    const std::vector<std::int32_t> hits = selfIntersectingTriangles(others);
    if (!hits.empty() && hits.front() == 0)
      expected.push_back(static_cast<std::int32_t>(t));
  }
  EXPECT_EQ(found, expected);
  EXPECT_LT(found.size(), selfIntersectingTriangles(mesh).size());
}

TEST(SelfIntersection, OneHugeTriangleAmongSmallOnes)
{
  // Bins of the small triangles' size would be too many over the large one.
  TriangleMesh mesh = squares(60);
  const auto first = static_cast<std::int32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {{30.2f, 30.3f, -1e5f}, {30.2f, 30.3f, 1e5f}, {1e6f, 1e6f, 1e5f}});
  mesh.triangles.push_back({first, first + 1, first + 2});
  EXPECT_EQ(selfIntersectingTriangles(mesh), exact::selfIntersectingTriangles(mesh));
}

TEST(SelfIntersection, RepeatedDegenerateAndNotFiniteTriangles)
{
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {1, 0, 2}};
  EXPECT_EQ(selfIntersectingTriangles(mesh), (std::vector<std::int32_t>{0, 1}));
  mesh.vertices = {{0, 0, 0}, {3, 0, 0}, {0, 3, 0}, {1, 1, -1}, {1, 1, 0}, {1, 1, 2}, {5, 5, -1}, {5, 5, 0}, {5, 5, 2}};
  mesh.triangles = {{0, 1, 2}, {6, 7, 8}};
  EXPECT_TRUE(selfIntersectingTriangles(mesh).empty()) << "collinear, and far from the other";
  mesh.triangles[1] = {3, 4, 5};
  EXPECT_EQ(selfIntersectingTriangles(mesh), (std::vector<std::int32_t>{0, 1})) << "collinear, and through the other";
  EXPECT_TRUE(selfIntersectingTriangles({}).empty());
  mesh = squares(2);
  mesh.vertices[0].x() = std::numeric_limits<float>::quiet_NaN();
  mesh.vertices[1].y() = std::numeric_limits<float>::infinity();
  EXPECT_TRUE(selfIntersectingTriangles(mesh).empty());
}

TEST(SelfIntersection, AsksOnTheWayWhetherToGoOn)
{
  const TriangleMesh mesh = zeroLevel(shapes::field(shapes::torus(.6, .25), 1, 128));
  ASSERT_GT(mesh.triangles.size(), 50000u);
  const auto search = [&](Execution& execution) { selfIntersectingTriangles(mesh, execution); };
  // About a microsecond per triangle, half of it in the pass that sorts them into bins one by one.
  EXPECT_GE(callsDuring(search), static_cast<std::int64_t>(mesh.triangles.size()) / 10000);
  expectCancelledWhereverItAsks(search);
}

namespace {

struct Surface {
  std::vector<Vector3f> positions, normals;

  void add(const Vector3f& position, const Vector3f& normal)
  {
    positions.push_back(position);
    normals.push_back(normal);
  }
};

/// Random points of the square [-10, 10]² at a height.
void addSheet(Surface& surface, float z, const Vector3f& normal)
{
  clouds::Random random(1);
  for (int n = 0; n < 4000; ++n) {
    Vector3f position = 10 * random.inCube().cast<float>();
    position.z() = z;
    surface.add(position, normal);
  }
}

double crowdedShare(const Surface& surface, const std::vector<Vector3f>& positions)
{
  Execution execution(2);
  const CrowdedSpace space(surface.positions, surface.normals, 1, execution);
  double count = 0;
  for (const Vector3f& p : positions)
    count += space.contains(p) ? 1 : 0;
  return count / static_cast<double>(positions.size());
}

} // namespace

TEST(CrowdedSpace, ASheetAloneIsNot)
{
  Surface flat;
  addSheet(flat, .3f, {0, 0, 1});
  EXPECT_EQ(crowdedShare(flat, flat.positions), 0);

  // A sphere of seven cells' radius: within the three cells around one, normals are within 23° of their mean.
  Surface sphere;
  clouds::Random random(1);
  for (int n = 0; n < 8000; ++n) {
    const Vector3f direction = random.direction().cast<float>();
    sphere.add(7 * direction, direction);
  }
  EXPECT_EQ(crowdedShare(sphere, sphere.positions), 0);
}

TEST(CrowdedSpace, SheetsThatFaceEachOtherAreUpToACellAway)
{
  for (const float gap : {.01f, .5f, .99f}) {
    Surface sheets;
    addSheet(sheets, 0, {0, 0, 1});
    addSheet(sheets, gap, {0, 0, -1});
    EXPECT_EQ(crowdedShare(sheets, sheets.positions), 1) << gap;
  }
  Surface apart;
  addSheet(apart, 0, {0, 0, 1});
  addSheet(apart, 3, {0, 0, -1});
  EXPECT_EQ(crowdedShare(apart, apart.positions), 0);
}

TEST(CrowdedSpace, CreasesAreAndWhatIsFarFromThemIsNot)
{
  Surface edge;
  addSheet(edge, 0, {0, 0, 1});
  for (Vector3f& p : edge.positions)
    p.x() = std::abs(p.x());
  const std::size_t count = edge.positions.size();
  for (std::size_t n = 0; n < count; ++n) // the square x = 0 below it
    edge.add({0, edge.positions[n].y(), -edge.positions[n].x()}, {-1, 0, 0});
  const CrowdedSpace space(edge.positions, edge.normals, 1, serial);
  for (const Vector3f& p : edge.positions) {
    const float distance = std::max(p.x(), -p.z());
    if (distance < .9f) {
      EXPECT_TRUE(space.contains(p)) << p.transpose();
    }
    if (distance > 2.1f) {
      EXPECT_FALSE(space.contains(p)) << p.transpose();
    }
  }
}

TEST(CrowdedSpace, HugeExtentsAndNoPositionsDoNoHarm)
{
  const CrowdedSpace none({}, {}, 1, serial);
  (void)none.contains({0, 0, 0});
  // More cells than indices: what shares one looks crowded at most.
  const std::vector<Vector3f> positions{{-1e9f, 0, 0}, {0, 0, 0}, {1e9f, 1e9f, 1e9f}};
  const CrowdedSpace space(positions, {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}, 1e-3f, serial);
  for (const Vector3f& p : positions)
    EXPECT_FALSE(space.contains(p));
}

TEST(CrowdedSpace, AsksOnTheWayWhetherToGoOn)
{
  Surface sheets;
  for (int n = 0; n < 10; ++n)
    addSheet(sheets, static_cast<float>(n), {0, 0, 1});
  const auto make = [&](Execution& execution) { CrowdedSpace(sheets.positions, sheets.normals, 1, execution); };
  // Positions are sorted into cells one by one, a tenth of a microsecond each.
  EXPECT_GE(callsDuring(make), static_cast<std::int64_t>(sheets.positions.size()) / 10000);
  expectCancelledWhereverItAsks(make);
}
