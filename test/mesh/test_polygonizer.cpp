// SPDX-License-Identifier: BSD-3-Clause
#include "exact/self_intersections.h"
#include "mesh/self_intersection.h"
#include "support/bands.h"
#include "support/meshes.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>

using namespace meshes;
using namespace pcl::mrf;
using Eigen::Vector3d;
using Eigen::Vector3f;
using shapes::pi;

namespace {

DistanceField makeField(GridSize size, std::vector<float> distances, double spacing = 1,
                        const Vector3d& origin = Vector3d::Zero())
{
  std::vector<float> confidences(distances.size(), 1.f);
  return {{size, origin, spacing}, std::move(distances), std::move(confidences)};
}

/// A field with the values `value(i, j, k)` inside a border of `outside`.
template <typename Value>
DistanceField enclosed(GridSize size, float outside, const Value& value, double spacing = 1,
                       const Vector3d& origin = Vector3d::Zero())
{
  std::vector<float> distances;
  shapes::forVoxels(size, [&](int i, int j, int k) {
    const bool isAtBorder = i % (size.x - 1) == 0 || j % (size.y - 1) == 0 || k % (size.z - 1) == 0;
    distances.push_back(isAtBorder ? outside : value(i, j, k));
  });
  return makeField(size, std::move(distances), spacing, origin);
}

/// Expects the properties that every extracted mesh must have, whatever the field.
void expectClosed(const MeshStatistics& mesh)
{
  expectSound(mesh);
  EXPECT_EQ(mesh.boundaryEdges, 0);
  EXPECT_EQ(mesh.eulerCharacteristic % 2, 0); // of a closed orientable surface, 2 per component less 2 per handle
}

} // namespace

/// Every pair of sign patterns as neighbors: both cells must cut their shared face alike.
TEST(Polygonizer, everyPairOfNeighboringPatternsIsClosedAndManifold)
{
  for (int signs = 0; signs < 4096; ++signs) {
    const DistanceField field = enclosed({5, 4, 4}, .7f, [&](int i, int j, int k) {
      return signs >> ((i - 1) + 3 * ((j - 1) | (k - 1) << 1)) & 1 ? -.4f : .5f;
    });
    const MeshStatistics mesh = measure(zeroLevel(field));
    ASSERT_TRUE(mesh.closed() && mesh.manifold() && mesh.degenerateTriangles + mesh.unusedVertices == 0) << signs;
    ASSERT_EQ(mesh.volume > 0, signs != 0) << "outward";
  }
}

/// Rows of more than one 64-voxel word, and rows that end exactly with a word.
TEST(Polygonizer, rowsOfAnyLengthAreClosedAndManifold)
{
  std::mt19937 random(8);
  std::normal_distribution<float> noise;
  for (const int length : {63, 64, 65, 127, 128, 129, 130}) {
    SCOPED_TRACE(length);
    const auto field = enclosed({length, 5, 5}, 1, [&](int, int, int) { return noise(random); });
    expectClosed(measure(zeroLevel(field)));
    // The same values with the axes exchanged need no word boundary.
    const auto turned = enclosed({5, 5, length}, 1, [&](int i, int j, int k) { return field.distance(k, i, j); });
    EXPECT_EQ(measure(zeroLevel(turned)).vertices, measure(zeroLevel(field)).vertices);
  }
}

/// Crossings near the ends of their edges give the flattest possible triangles.
TEST(Polygonizer, noTriangleDegeneratesWithValuesNearZero)
{
  const std::vector<float> values{
      0.f, -0.f, 1e-30f, -1e-30f, std::numeric_limits<float>::denorm_min(), -std::numeric_limits<float>::denorm_min(),
      1.f, -1.f, 1e30f,  -1e30f};
  std::mt19937 random(9);
  std::uniform_int_distribution<std::size_t> pick(0, values.size() - 1);
  const auto value = [&](int, int, int) { return values[pick(random)]; };
  // Origins in voxels: near, at 5,000 and at 100,000 voxels from the frame's origin, where float keeps 1/2048 and
  // 1/128.
  for (const double distance : {-8., 5000., 100000.})
    for (const double spacing : {1., 1e-3, 370.}) {
      SCOPED_TRACE(::testing::Message() << distance << " voxels of " << spacing);
      const Vector3d origin = distance * spacing * Vector3d(1, -1, .7);
      const MeshStatistics mesh = measure(zeroLevel(enclosed({16, 16, 16}, 1, value, spacing, origin)));
      expectClosed(mesh);
    }
}

TEST(Polygonizer, zeroIsOutside)
{
  EXPECT_TRUE(zeroLevel(DistanceField()).triangles.empty());
  EXPECT_TRUE(zeroLevel(makeField({3, 3, 3}, std::vector<float>(27, -1.f))).triangles.empty());
  EXPECT_TRUE(zeroLevel(makeField({3, 3, 3}, std::vector<float>(27, 0.f))).triangles.empty());
  EXPECT_TRUE(zeroLevel(makeField({3, 3, 3}, std::vector<float>(27, -0.f))).triangles.empty());
  // Negative all over but for one zero: the surface is a bubble around it, with its normals towards the zero.
  std::vector<float> distances(27, -1.f);
  distances[13] = 0;
  const MeshStatistics mesh = measure(zeroLevel(makeField({3, 3, 3}, distances)));
  expectClosed(mesh);
  EXPECT_EQ(mesh.eulerCharacteristic, 2);
  EXPECT_LT(mesh.volume, 0);
}

TEST(Polygonizer, infiniteAndUndefinedValuesGiveFinitePositions)
{
  const float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> values{-infinity, infinity, nan, -1.f, 1.f};
  std::mt19937 random(10);
  std::uniform_int_distribution<std::size_t> pick(0, values.size() - 1);
  const TriangleMesh mesh =
      zeroLevel(enclosed({9, 9, 9}, infinity, [&](int, int, int) { return values[pick(random)]; }));
  EXPECT_TRUE(std::all_of(mesh.vertices.begin(), mesh.vertices.end(), [](const Vector3f& x) { return x.allFinite(); }));
  expectClosed(measure(mesh));
}

TEST(Polygonizer, leavesTheLatticeOnlyAtItsBorder)
{
  std::mt19937 random(12);
  std::normal_distribution<float> noise;
  std::vector<float> distances(11 * 12 * 13);
  for (float& distance : distances)
    distance = noise(random);
  const TriangleMesh mesh = zeroLevel(makeField({11, 12, 13}, distances));
  const MeshStatistics statistics = measure(mesh);
  expectSound(statistics);
  EXPECT_GT(statistics.boundaryEdges, 0);
  // An edge is on the boundary exactly if both its ends are on one face of the lattice's box.
  const Vector3f last(10, 11, 12);
  std::int64_t onFace = 0;
  std::map<std::pair<std::int32_t, std::int32_t>, int> sides;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t c = 0; c < 3; ++c)
      ++sides[std::minmax(t[c], t[(c + 1) % 3])];
  for (const auto& [edge, count] : sides) {
    const Vector3f& a = mesh.vertices[edge.first];
    const Vector3f& b = mesh.vertices[edge.second];
    bool shared = false;
    for (int axis = 0; axis < 3; ++axis)
      shared = shared || (a[axis] == b[axis] && (a[axis] == 0 || a[axis] == last[axis]));
    EXPECT_EQ(count, shared ? 1 : 2);
    onFace += shared ? 1 : 0;
  }
  EXPECT_EQ(onFace, statistics.boundaryEdges);
}

TEST(Polygonizer, cellsOfSeveralSizesAreClosedAndManifold)
{
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<float> noise;
    const DistanceField field = bands::nested(
        random, [&](const Vector3f& x) { return (x.array() - 16).abs().maxCoeff() < 9 ? noise(random) : 1.f; });
    const TriangleMesh mesh = zeroLevel(field);
    const MeshStatistics statistics = measure(mesh);
    EXPECT_EQ(statistics.boundaryEdges, 0) << seed;
    EXPECT_EQ(statistics.nonManifoldEdges, 0) << seed;
    EXPECT_EQ(statistics.nonManifoldVertices, 0) << seed;
    EXPECT_EQ(statistics.unusedVertices, 0) << seed;
    EXPECT_GT(statistics.triangles, 500) << seed;
  }
}

TEST(Polygonizer, cellsOfSeveralSizesComeCloseToTheBorder)
{
  // A cell of four voxels would begin at the last but three.
  std::mt19937 random(2);
  const auto sphere = [](const Vector3f& x) { return (x - Vector3f(15.5f, 15.5f, 15.5f)).norm() - 14; };
  const MeshStatistics mesh = measure(zeroLevel(bands::nested(random, sphere)));
  EXPECT_EQ(mesh.boundaryEdges, 0);
  EXPECT_EQ(mesh.eulerCharacteristic, 2);
}

TEST(Polygonizer, cellsOfSeveralSizesFollowOneSurface)
{
  std::mt19937 random(1);
  const auto sphere = [](const Vector3f& x) { return (x - Vector3f(16, 15.5f, 16.5f)).norm() - 9; };
  const TriangleMesh mesh = zeroLevel(bands::nested(random, sphere));
  const MeshStatistics statistics = measure(mesh);
  EXPECT_EQ(statistics.boundaryEdges, 0);
  EXPECT_EQ(statistics.eulerCharacteristic, 2);
  const TriangleMesh fine = zeroLevel(enclosed({32, 32, 32}, 1, [&](int i, int j, int k) {
    return sphere(Vector3f(static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)));
  }));
  EXPECT_LT(static_cast<double>(mesh.triangles.size()), .7 * static_cast<double>(fine.triangles.size()));
  for (const Vector3f& vertex : mesh.vertices)
    EXPECT_LT(std::abs(sphere(vertex)), .8); // 4² · 3 / (8 · 9): what a trilinear cell of 4 voxels may be off
}

TEST(Polygonizer, doesNotDependOnThreads)
{
  std::mt19937 random(13);
  std::normal_distribution<float> noise;
  const auto field = enclosed({40, 33, 29}, 1, [&](int, int, int) { return noise(random); });
  sameOnAnyThreads([&](int threads) {
    const TriangleMesh mesh = zeroLevel(field, threads);
    return std::make_pair(mesh.vertices, mesh.triangles);
  });
}

struct Solid {
  const char* name;
  shapes::Sdf sdf;
  double area, volume; ///< of the truth
  std::int64_t components, eulerCharacteristic;
};

std::vector<Solid> solids()
{
  const double r = .61, major = .6, minor = .22, tubeRadius = .16, tubeLength = 1.1;
  // A box with rounded edges: an inner box of half sides h − ρ grown by ρ (Steiner's formula).
  const Vector3d half(.63, .52, .41);
  const double rounding = .15;
  const Vector3d inner = 2 * (half - Vector3d::Constant(rounding));
  const double innerArea = 2 * (inner.x() * inner.y() + inner.y() * inner.z() + inner.z() * inner.x());
  const double boxArea = innerArea + 2 * pi * rounding * inner.sum() + 4 * pi * rounding * rounding;
  const double boxVolume = inner.prod() + innerArea * rounding + pi * rounding * rounding * inner.sum() +
                           4. / 3 * pi * std::pow(rounding, 3);
  const Vector3d along = tubeLength * Vector3d(.9, .3, .2).normalized();
  const Vector3d start = Vector3d(-.5, -.4, -.2), aside(-.05, .45, .3);
  return {
      {"sphere", shapes::sphere(r, {.03, -.02, .05}), 4 * pi * r * r, 4. / 3 * pi * r * r * r, 1, 2},
      {"torus", shapes::torus(major, minor), 4 * pi * pi * major * minor, 2 * pi * pi * major * minor * minor, 1, 0},
      {"box", shapes::box(half, rounding), boxArea, boxVolume, 1, 2},
      {"two tubes",
       shapes::unite(shapes::tube(start, start + along, tubeRadius),
                     shapes::tube(start + aside, start + along + aside, tubeRadius)),
       2 * (2 * pi * tubeRadius * tubeLength + 4 * pi * tubeRadius * tubeRadius),
       2 * (pi * tubeRadius * tubeRadius * tubeLength + 4. / 3 * pi * std::pow(tubeRadius, 3)), 2, 4}};
}

TEST(Polygonizer, areaAndVolumeConvergeAtSecondOrder)
{
  for (const Solid& solid : solids()) {
    SCOPED_TRACE(solid.name);
    std::vector<double> areaErrors, volumeErrors;
    for (const int voxels : {24, 48, 96}) {
      const MeshStatistics mesh = measure(zeroLevel(shapes::field(solid.sdf, 1, voxels)));
      expectClosed(mesh);
      EXPECT_EQ(mesh.components, solid.components);
      EXPECT_EQ(mesh.eulerCharacteristic, solid.eulerCharacteristic);
      areaErrors.push_back(std::abs(mesh.area / solid.area - 1));
      volumeErrors.push_back(std::abs(mesh.volume / solid.volume - 1));
    }
    // Two halvings: 16 at second order; a first-order error would give 4.
    EXPECT_GT(areaErrors.front() / areaErrors.back(), 9);
    EXPECT_GT(volumeErrors.front() / volumeErrors.back(), 9);
    EXPECT_LT(volumeErrors.back(), .01);
  }
}

/// Pieces of two cells meet only in their common face, and no two pieces of one cell cross.
TEST(Polygonizer, whiteNoiseDoesNotIntersectItself)
{
  std::mt19937 random(14);
  std::normal_distribution<float> noise;
  const auto field = enclosed({14, 14, 14}, 1, [&](int, int, int) { return noise(random); });
  EXPECT_EQ(exact::selfIntersectingTriangles(zeroLevel(field)).size(), 0u);
}
