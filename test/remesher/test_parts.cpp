// SPDX-License-Identifier: BSD-3-Clause
#include "base/spatial_sort.h"
#include "mesh/self_intersection.h"
#include "mesh/vertex_fields.h"
#include "remesher/parts.h"
#include "remesher/zero_level.h"
#include "support/cancelling.h"
#include "support/meshes.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <pcl/surface/mrf/exceptions.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

using namespace meshes;
using namespace pcl::mrf;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

constexpr double halfSide = 1;
constexpr int voxels = 32;
constexpr double spacing = 2 * halfSide / voxels;

RemeshResult remeshedInParts(const TriangleMesh& mesh, const DistanceField& field, std::int64_t triangles,
                             const RemesherOptions& options = {}, int threads = 1)
{
  Execution execution(threads);
  return remesh(mesh, field, {}, options, execution, triangles);
}

void expectSameBytes(const RemeshResult& a, const RemeshResult& b)
{
  expectSame(a.mesh, b.mesh);
  EXPECT_EQ(a.refusedOperations, b.refusedOperations);
}

/// Expects the results that must not depend on the parts. \return the mesh's statistics
MeshStatistics expectLikeWhole(const RemeshResult& result, const RemeshResult& whole, double qualityLoss = .01)
{
  const MeshStatistics own = measure(result.mesh), other = measure(whole.mesh);
  expectSound(own);
  EXPECT_EQ(own.components, other.components);
  EXPECT_EQ(own.boundaryLoops, other.boundaryLoops);
  EXPECT_EQ(own.eulerCharacteristic, other.eulerCharacteristic);
  EXPECT_TRUE(selfIntersectingTriangles(result.mesh).empty());
  EXPECT_EQ(result.intersecting, 0);
  EXPECT_EQ(result.targetEdge, whole.targetEdge);
  const std::vector<std::uint8_t> all(result.mesh.vertices.size(), 1);
  const std::vector<std::uint32_t> order = spatialOrder(result.mesh.vertices, all, serial);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end())) << "along the curve";
  EXPECT_NEAR(own.meanQuality, other.meanQuality, qualityLoss);
  EXPECT_NEAR(own.area, other.area, .002 * other.area);
  const auto triangles = static_cast<double>(other.triangles);
  EXPECT_NEAR(static_cast<double>(own.triangles), triangles, .06 * triangles); // parts of 100 leave 3 to 5.2 % more
  return own;
}

std::vector<shapes::Sdf> closedShapes()
{
  using namespace shapes;
  return {sphere(.7), torus(.6, .25), box({.7, .5, .6}, .25),
          unite(tube({-.6, 0, -.35}, {.6, .1, -.35}, .25), tube({-.6, 0, .35}, {.6, -.1, .3}, .25))};
}

/// A disc with a hole, cut out of a plane along the voxels' triangles.
TriangleMesh ringOf(const DistanceField& field)
{
  return selectWhere(zeroLevel(field), [](const Vector3f& p) { return p.norm() > .3f && p.norm() < .8f; });
}

DistanceField planeField()
{
  return shapes::field(shapes::plane({.1, .2, 1}), halfSide, voxels);
}

/// A mesh with the parts that it is cut into, and all that remeshParts() needs.
struct Cut {
  ZeroLevel level;
  PartedMesh mesh;
  RemesherOptions options;
  RemeshPlan plan;
  PartNumbers parts;

  Cut(const DistanceField& field, const TriangleMesh& triangles)
      : level(field, static_cast<float>(spacing / 2)), mesh{triangles, {}, {}, {}},
        plan(planFor(mesh.mesh, field, {}, options, serial))
  {
    plan.curves = BorderCurves(
        mesh.mesh.vertices, plan.nextOnBorder, level.maxStep(), [](Vector3f&) { return true; }, mesh.places);
  }
  RemeshResult remesh()
  {
    RemeshResult result;
    remeshParts(mesh, parts, plan, level, options, result, serial);
    return result;
  }
};

bool isSeam(const Triangle& t, const PartNumbers& parts)
{
  return parts[t[0]] != parts[t[1]] || parts[t[1]] != parts[t[2]];
}

} // namespace

TEST(RemeshParts, ShapesAreLikeTheWholeWhateverTheParts)
{
  for (const shapes::Sdf& sdf : closedShapes()) {
    const DistanceField field = shapes::field(sdf, halfSide, voxels);
    const TriangleMesh raw = zeroLevel(field);
    const RemeshResult whole = remeshedInParts(raw, field, 0);
    // The smallest are a few edges wide, less than the shapes' roundings: all is at seams, and strips are narrow.
    for (const std::int64_t triangles : {100, 1000, 3000}) {
      SCOPED_TRACE(testing::Message() << raw.triangles.size() << " in parts of " << triangles);
      const RemeshResult result = remeshedInParts(raw, field, triangles);
      EXPECT_TRUE(expectLikeWhole(result, whole, triangles == 100 ? .02 : .01).closed());
      // Vertices are above the level by as much as triangles would cut off: l²/8R for edges of a voxel, R .25.
      for (const Vector3f& p : result.mesh.vertices)
        ASSERT_LT(std::abs(sdf(p.cast<double>())), .5 * spacing * spacing / .25);
    }
  }
}

TEST(RemeshParts, OnePartIsTheWhole)
{
  const DistanceField field = shapes::field(shapes::torus(.6, .25), halfSide, voxels);
  const TriangleMesh raw = zeroLevel(field);
  const RemeshResult whole = remeshedInParts(raw, field, 0);
  expectSameBytes(remeshedInParts(raw, field, 1000000), whole);
  EXPECT_NE(remeshedInParts(raw, field, 1000).mesh.vertices, whole.mesh.vertices);
}

TEST(RemeshParts, WhatIsAtSeamsStaysUntilItsStripIsMade)
{
  const DistanceField field = shapes::field(shapes::torus(.6, .25), halfSide, voxels);
  Cut cut(field, zeroLevel(field));
  cut.parts = cutIntoBoxes(cut.mesh.mesh.vertices, 500);
  const TriangleMesh before = cut.mesh.mesh;
  EXPECT_GT(cut.remesh().splits, 0);
  const auto corners = cornersOf(cut.mesh.mesh);
  const std::set<std::array<std::array<float, 3>, 3>> after(corners.begin(), corners.end());
  TriangleMesh seams = before;
  seams.triangles.clear();
  std::copy_if(before.triangles.begin(), before.triangles.end(), std::back_inserter(seams.triangles),
               [&](const Triangle& t) { return isSeam(t, cut.parts); });
  for (const auto& triangle : cornersOf(seams))
    EXPECT_EQ(after.count(triangle), 1u);
  EXPECT_TRUE(measure(cut.mesh.mesh).closed()) << "parts are joined by what stayed";
  // All that stayed is known to be at a seam, and of nothing else is that said.
  std::set<std::int32_t> atSeams;
  for (const Triangle& t : seams.triangles)
    atSeams.insert(t.begin(), t.end());
  const auto known = std::count_if(cut.mesh.seams.begin(), cut.mesh.seams.end(), [](std::int32_t p) { return p >= 0; });
  EXPECT_EQ(known, static_cast<std::ptrdiff_t>(atSeams.size()));

  std::set<std::pair<float, float>> former;
  for (const Vector3f& p : before.vertices)
    former.emplace(p.x(), p.y());
  for (int run = 0; run < 10; ++run) {
    cut.parts = stripsAlong(cut.mesh.seams, cut.mesh.mesh.triangles, 500);
    cut.remesh();
  }
  EXPECT_EQ(*std::max_element(cut.mesh.seams.begin(), cut.mesh.seams.end()), -1) << "none is left over";
  const auto stayed =
      std::count_if(cut.mesh.mesh.vertices.begin(), cut.mesh.mesh.vertices.end(), [&](const Vector3f& p) {
        return former.count({p.x(), p.y()}) > 0;
      });
  EXPECT_LT(stayed, 5) << "of what was at seams, too";
}

TEST(RemeshParts, TrianglesAtSeamsAreAsGoodAsElsewhere)
{
  const DistanceField field = shapes::field(shapes::sphere(.8), halfSide, 2 * voxels);
  const TriangleMesh raw = zeroLevel(field);
  constexpr std::int64_t triangles = 5000;
  const TriangleMesh mesh = remeshedInParts(raw, field, triangles).mesh;
  const PartNumbers parts = cutIntoBoxes(raw.vertices, triangles / 2);
  TriangleMesh seams;
  for (const Triangle& t : raw.triangles)
    if (isSeam(t, parts))
      seams.vertices.push_back(raw.vertices[t[0]]);
  double near = 0, far = 0;
  int nearCount = 0, farCount = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const bool isNear = std::any_of(seams.vertices.begin(), seams.vertices.end(),
                                    [&](const Vector3f& p) { return (p - a).norm() < static_cast<float>(spacing); });
    (isNear ? near : far) += triangleQuality(a, b, c);
    ++(isNear ? nearCount : farCount);
  }
  ASSERT_GT(std::min(nearCount, farCount), 1000);
  EXPECT_NEAR(near / nearCount, far / farCount, .01);
}

TEST(RemeshParts, BordersAreCurvesAcrossSeams)
{
  const DistanceField field = planeField();
  const TriangleMesh raw = ringOf(field);
  const RemeshResult whole = remeshedInParts(raw, field, 0);
  const double length = lengthOf(whole.mesh, boundaryOf(whole.mesh));
  for (const std::int64_t triangles : {300, 1000}) {
    SCOPED_TRACE(triangles);
    const RemeshResult result = remeshedInParts(raw, field, triangles);
    const MeshStatistics own = expectLikeWhole(result, whole);
    EXPECT_EQ(own.boundaryLoops, 2);
    EXPECT_GT(own.minQuality, .3);
    // Teeth are gone everywhere: of the raw border's length a tenth and more is theirs.
    EXPECT_NEAR(lengthOf(result.mesh, boundaryOf(result.mesh)), length, .01 * length);
    for (const Vector3f& p : result.mesh.vertices) // on the plane still, and between the curves
      ASSERT_LT(std::abs(p.dot(Vector3f(.1f, .2f, 1).normalized())), .02 * spacing);
  }
}

TEST(RemeshParts, PartsThatComeToIntersectAreMadeAgain)
{
  // Two sheets that face the same way within a voxel, both drawn to one zero level, each a part by itself.
  const DistanceField field = planeField();
  TriangleMesh sheets;
  for (const float offset : {-.15f, .2f})
    append(sheets, zeroLevel(field), offset * static_cast<float>(spacing) * Vector3f(.1f, .2f, 1));
  ASSERT_TRUE(selfIntersectingTriangles(sheets).empty());
  Cut cut(field, sheets);
  const auto half = static_cast<std::ptrdiff_t>(cut.mesh.mesh.vertices.size() / 2);
  cut.parts.assign(cut.mesh.mesh.vertices.size(), 1);
  std::fill(cut.parts.begin(), cut.parts.begin() + half, 0);
  cut.mesh.seams = cut.parts; // as if all were strips
  cut.remesh();
  EXPECT_TRUE(selfIntersectingTriangles(cut.mesh.mesh).empty());
  EXPECT_EQ(*std::max_element(cut.mesh.seams.begin(), cut.mesh.seams.end()), -1)
      << "what must stay for good is not asked for again";
  const MeshStatistics after = measure(cut.mesh.mesh);
  expectSound(after);
  EXPECT_EQ(after.components, 2);
  EXPECT_EQ(after.eulerCharacteristic, 2);
}

TEST(RemeshParts, BordersThatTouchComeApart)
{
  // A ring cut open at the vertices along one edge path: both sides have their own, at the same places.
  const DistanceField field = planeField();
  const TriangleMesh whole = ringOf(field);
  TriangleMesh raw;
  for (const bool isLeft : {false, true})
    append(raw, selectWhere(whole, [=](const Vector3f& p) { return (p.x() < 0) == isLeft; }));
  ASSERT_FALSE(selfIntersectingTriangles(raw).empty());
  const RemeshResult result = remeshedInParts(raw, field, 500);
  EXPECT_TRUE(selfIntersectingTriangles(result.mesh).empty());
  EXPECT_GT(result.intersectingBefore, 0);
  EXPECT_EQ(measure(result.mesh).boundaryLoops, measure(raw).boundaryLoops);
}

TEST(RemeshParts, EdgesAreAsLongAsTheirSizing)
{
  const DistanceField field = shapes::field(shapes::sphere(.8), halfSide, 2 * voxels);
  const TriangleMesh raw = zeroLevel(field);
  EdgeSizing sizing;
  for (const Vector3f& p : raw.vertices)
    sizing.push_back(p.x() > .2f ? 3.f : 1.f);
  expectLikeWhole(remesh(raw, field, sizing, {}, serial, 4000), remesh(raw, field, sizing, {}, serial));
}

TEST(RemeshParts, AsManyTrianglesAsAskedFor)
{
  const DistanceField field = shapes::field(shapes::torus(.6, .25), halfSide, voxels);
  RemesherOptions options;
  options.triangles = 1000;
  const RemeshResult result = remeshedInParts(zeroLevel(field), field, 1500, options);
  EXPECT_EQ(result.mesh.triangles.size(), 1000u);
  EXPECT_EQ(measure(result.mesh).eulerCharacteristic, 0);
  EXPECT_EQ(result.intersecting, 0);
}

TEST(RemeshParts, SameBytesForAnyNumberOfThreads)
{
  const DistanceField field = shapes::field(shapes::torus(.6, .25), halfSide, 2 * voxels);
  const TriangleMesh raw = zeroLevel(field);
  const RemeshResult reference = remeshedInParts(raw, field, 12000);
  for (const int threads : {2, 3})
    expectSameBytes(remeshedInParts(raw, field, 12000, {}, threads), reference);
}

TEST(RemeshParts, StopsWhereverItAsks)
{
  const DistanceField field = planeField();
  const TriangleMesh raw = ringOf(field);
  RemesherOptions options;
  options.rounds = 2;
  expectCancelledWhereverItAsks([&](Execution& execution) { remesh(raw, field, {}, options, execution, 400); });
}

TEST(RemeshParts, ProgressRisesPartByPart)
{
  const DistanceField field = shapes::field(shapes::torus(.6, .25), halfSide, voxels);
  std::set<double> fractions;
  Execution execution(1, [&](const std::string&, double fraction) {
    fractions.insert(fraction);
    return true;
  });
  remesh(zeroLevel(field), field, {}, {}, execution, 500);
  EXPECT_GT(std::distance(fractions.begin(), fractions.lower_bound(.69)), 8) << "of ten parts and more";
}

TEST(RemeshParts, RefusesBadMeshes)
{
  const DistanceField field = shapes::field(shapes::sphere(.7), halfSide, voxels);
  TriangleMesh raw = zeroLevel(field);
  std::swap(raw.triangles[5][0], raw.triangles[5][1]);
  EXPECT_THROW(remeshedInParts(raw, field, 500), InvalidInput);
  raw = zeroLevel(field);
  // In no triangle, and in no order.
  raw.vertices.resize(2 * raw.vertices.size(), Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_TRUE(measure(remeshedInParts(raw, field, 500).mesh).closed());
}

TEST(PartCutting, BoxesHaveEquallyManyVertices)
{
  const TriangleMesh mesh = squares(30);
  const PartNumbers parts = cutIntoBoxes(mesh.vertices, 150);
  ASSERT_EQ(*std::max_element(parts.begin(), parts.end()), 6); // 961 in 7
  for (int part = 0; part < 7; ++part)
    EXPECT_NEAR(static_cast<double>(std::count(parts.begin(), parts.end(), part)), 961. / 7, 3);
}

TEST(PartCutting, StripsReachEightEdgesFromTheSeamAndOneOfTheirRim)
{
  // A seam of two parts up the middle column of a grid.
  constexpr int side = 40;
  const TriangleMesh mesh = squares(side);
  PartNumbers seams(mesh.vertices.size(), -1);
  for (int j = 0; j <= side; ++j) {
    seams[j * (side + 1) + 20] = 0;
    seams[j * (side + 1) + 21] = 1;
  }
  const PartNumbers strips = stripsAlong(seams, mesh.triangles, 100000);
  for (int i = 0; i <= side; ++i) // part 1 is beside part 0, which takes its side of the seam along
    EXPECT_EQ(strips[20 * (side + 1) + i], std::abs(i - 20) <= 9 ? 0 : -1) << i;
  EXPECT_EQ(std::count(strips.begin(), strips.end(), 1), 0);
}

TEST(PartCutting, OfTheFirstPartNothingIsLeftOver)
{
  // Another one is two edges away, with what is between them on a third one's seam.
  constexpr int side = 40;
  const TriangleMesh mesh = squares(side);
  PartNumbers seams(mesh.vertices.size(), -1);
  const auto column = [](int i, int j) { return static_cast<std::size_t>(j * (side + 1) + i); };
  for (int j = 0; j <= side; ++j) {
    seams[column(19, j)] = 1;
    seams[column(20, j)] = 2;
    seams[column(21, j)] = 0;
  }
  const PartNumbers strips = stripsAlong(seams, mesh.triangles, 100000);
  for (int j = 0; j <= side; ++j)
    for (const int i : {20, 21, 22})
      ASSERT_EQ(strips[column(i, j)], 0);
}
