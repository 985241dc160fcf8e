// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/mesh_topology.h"
#include "mesh/self_intersection.h"
#include "mesh/vertex_fields.h"
#include "remesher/intersection_watch.h"
#include "remesher/passes.h"
#include "remesher/remesher.h"
#include "remesher/zero_level.h"
#include "support/bands.h"
#include "support/cancelling.h"
#include "support/clouds.h"
#include "support/meshes.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <pcl/surface/mrf/exceptions.h>

#include <Eigen/Geometry>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

using namespace meshes;
using namespace pcl::mrf;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

constexpr double halfSide = 1;
constexpr int voxels = 32;
constexpr double spacing = 2 * halfSide / voxels;

struct Case {
  std::string name;
  shapes::Sdf sdf;
  int euler;
  double radius; ///< smallest radius of curvature

  /// How far the zero level may be from the shape: trilinear interpolation errs by at most h²/8 times the second
  /// derivative in each of two directions, and the trace stops within a thousandth of a voxel of it.
  double levelDistance() const { return .25 * spacing * spacing / radius + .002 * spacing; }

  /// Vertices are above it by l²/8R, of edges up to 4/3 h, so that the middles of edges are on it.
  double vertexDistance() const { return levelDistance() + .22 * spacing * spacing / radius; }

  /// The middle of an equilateral triangle of side 4/3 h is at most l²/6R below its corners' sphere.
  double middleDistance() const { return levelDistance() + .3 * spacing * spacing / radius; }
};

std::vector<Case> closedShapes()
{
  using namespace shapes;
  const Sdf tubes = unite(tube({-.6, 0, -.35}, {.6, .1, -.35}, .25), tube({-.6, 0, .35}, {.6, -.1, .3}, .25));
  return {{"sphere", sphere(.7), 2, .7},
          {"torus", torus(.6, .25), 0, .25},
          {"roundedBox", box({.7, .5, .6}, .25), 2, .25},
          {"twoTubes", tubes, 4, .25}};
}

double distanceToLevel(const DistanceField& field, const Vector3f& p)
{
  return std::abs(field.sampleDistance(p)) / field.sampleGradient(p).norm() / field.lattice().spacing;
}

Vector3d middleOf(const TriangleMesh& mesh, const Triangle& t)
{
  return (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]).cast<double>() / 3;
}

Vector3d normalOf(const TriangleMesh& mesh, const Triangle& t)
{
  return TriangleCorners(mesh, t).cross().normalized();
}

using Border = std::map<std::int32_t, std::int32_t>;

/// The maximum distance from a border's vertices to another border.
double farthest(const TriangleMesh& mesh, const Border& border, const TriangleMesh& other, const Border& otherBorder)
{
  double result = 0;
  for (const auto& edge : border) {
    const Vector3f& p = mesh.vertices[edge.first];
    float nearest = std::numeric_limits<float>::max();
    for (const auto& otherEdge : otherBorder) {
      const Vector3f from = other.vertices[otherEdge.first], along = other.vertices[otherEdge.second] - from;
      const float share = std::clamp((p - from).dot(along) / along.squaredNorm(), 0.f, 1.f);
      nearest = std::min(nearest, (from + share * along - p).norm());
    }
    result = std::max<double>(result, nearest);
  }
  return result;
}

RemeshResult remeshed(const TriangleMesh& mesh, const DistanceField& field, const RemesherOptions& options = {},
                      const EdgeSizing& sizing = {}, int threads = 1)
{
  Execution execution(threads);
  return remesh(mesh, field, sizing, options, execution);
}

RemesherOptions withTarget(double edge)
{
  RemesherOptions options;
  options.targetEdge = static_cast<float>(edge);
  return options;
}

/// The same; expects the topology to be kept, and no intersections.
RemeshResult soundlyRemeshed(const TriangleMesh& mesh, const DistanceField& field, const RemesherOptions& options = {},
                             const EdgeSizing& sizing = {})
{
  RemeshResult result = remeshed(mesh, field, options, sizing);
  const MeshStatistics before = measure(mesh), after = measure(result.mesh);
  expectSound(after);
  EXPECT_EQ(after.eulerCharacteristic, before.eulerCharacteristic);
  EXPECT_EQ(after.components, before.components);
  EXPECT_EQ(after.boundaryLoops, before.boundaryLoops);
  EXPECT_EQ(result.intersecting, 0);
  EXPECT_TRUE(selfIntersectingTriangles(result.mesh).empty());
  return result;
}

} // namespace

TEST(Remesher, ClosedShapesBecomeEvenAndStayOnTheSurface)
{
  for (const Case& shape : closedShapes()) {
    SCOPED_TRACE(shape.name);
    const DistanceField field = shapes::field(shape.sdf, halfSide, voxels);
    const TriangleMesh raw = zeroLevel(field);
    const MeshStatistics before = measure(raw);
    ASSERT_EQ(before.eulerCharacteristic, shape.euler);

    const RemeshResult result = soundlyRemeshed(raw, field);
    const MeshStatistics after = measure(result.mesh);
    EXPECT_GT(after.meanQuality, .92);
    EXPECT_GT(after.minQuality, .3);
    EXPECT_GE(after.regularShare(), .6);
    EXPECT_LT(after.areaDeviation, .5 * before.areaDeviation);
    EXPECT_NEAR(after.meanEdge, result.targetEdge, .15 * result.targetEdge);
    EXPECT_GT(result.splits, 0);
    EXPECT_GT(result.collapses, 0);
    EXPECT_GT(result.flips, 0);

    for (const Vector3f& p : result.mesh.vertices) {
      ASSERT_LT(distanceToLevel(field, p), .1);
      ASSERT_LT(std::abs(shape.sdf(p.cast<double>())), shape.vertexDistance());
    }
    for (const Triangle& t : result.mesh.triangles) {
      const Vector3d middle = middleOf(result.mesh, t);
      ASSERT_LT(std::abs(shape.sdf(middle)), shape.middleDistance());
      // No triangle turned over: curvature within a triangle and the rounding off by the grid stay far below 60°.
      ASSERT_GT(normalOf(result.mesh, t).dot(shapes::normalOf(shape.sdf, middle)), .5);
    }
    // All of the shape is still covered: the area is the raw one's, whose facets stray by fractions of a per cent.
    EXPECT_NEAR(after.area, before.area, .01 * before.area);
  }
}

TEST(Remesher, TrianglesCutOffAsMuchAsTheyAdd)
{
  // Of a sphere: if their corners were on it they would cut off l²/8R in the mean, and be off by l²/7R in the root mean
  // square. Edges of four voxels, so that what the field itself is off by is little beside it.
  constexpr double radius = .7;
  const DistanceField field = shapes::field(shapes::sphere(radius), halfSide, 2 * voxels);
  RemesherOptions options = withTarget(2 * spacing);
  const RemeshResult result = remeshed(zeroLevel(field), field, options);
  const double meanEdge = measure(result.mesh).meanEdge, sagitta = meanEdge * meanEdge / (8 * radius);
  double area = 0, sum = 0, squares = 0;
  for (const Triangle& t : result.mesh.triangles) {
    const TriangleCorners corners(result.mesh, t);
    const auto& [a, b, c] = corners;
    const double weight = corners.area();
    constexpr int parts = 8; // along a side
    for (int i = 0; i < parts; ++i)
      for (int j = 0; i + j < parts; ++j) {
        const double ofB = (i + 1. / 3) / parts, ofC = (j + 1. / 3) / parts;
        const double distance = (a + ofB * (b - a) + ofC * (c - a)).norm() - radius;
        area += weight;
        sum += weight * distance;
        squares += weight * distance * distance;
      }
  }
  EXPECT_LT(std::abs(sum / area), .1 * sagitta);
  EXPECT_LT(std::sqrt(squares / area), .4 * sagitta);

  options.fit = false;
  for (const Vector3f& p : remeshed(zeroLevel(field), field, options).mesh.vertices)
    ASSERT_LT(distanceToLevel(field, p), .01);
}

TEST(Remesher, TinyTrianglesAndTheirNeedlesGo)
{
  // Where the surface passes a voxel center closely, polygonizing cuts off a tiny triangle with a needle on each of its
  // sides: no edge of these can go without making another needle thinner for the moment.
  const Lattice lattice = shapes::field(shapes::sphere(.5), halfSide, voxels).lattice();
  const double toCenter = lattice.position(26, 24, 18).cast<double>().norm();
  for (const double voxelsAway : {.001, .002, -.001}) {
    SCOPED_TRACE(voxelsAway);
    const DistanceField field = shapes::field(shapes::sphere(toCenter + voxelsAway * spacing), halfSide, voxels);
    const TriangleMesh raw = zeroLevel(field);
    ASSERT_LT(measure(raw).minQuality, .01) << "no needles to begin with";
    EXPECT_GT(measure(soundlyRemeshed(raw, field).mesh).minQuality, .3);
  }
}

TEST(Remesher, SharpBoxStaysValid)
{
  const shapes::Sdf sdf = shapes::box({.7, .5, .61});
  const DistanceField field = shapes::field(sdf, halfSide, voxels);
  const RemeshResult result = soundlyRemeshed(zeroLevel(field), field);
  EXPECT_GT(measure(result.mesh).meanQuality, .92);
  // A chord of 4/3 of a voxel over a right-angled edge passes 2/3 of a voxel below it.
  for (const Triangle& t : result.mesh.triangles)
    ASSERT_LT(std::abs(sdf(middleOf(result.mesh, t))), .67 * spacing);
  // What the chords cut off at edges does not bend the faces beside them.
  int onFaces = 0;
  for (const Vector3f& p : result.mesh.vertices) {
    const Eigen::Array3d inside = Eigen::Array3d(.7, .5, .61) - p.cast<double>().array().abs();
    if ((inside < 2 * spacing).count() == 1) {
      ASSERT_LT(std::abs(inside.minCoeff()), .02 * spacing);
      ++onFaces;
    }
  }
  EXPECT_GT(onFaces, 500);
}

TEST(Remesher, ThinPlateKeepsItsTwoSheets)
{
  const shapes::Sdf sdf = shapes::box({.7, .6, 1.5 * spacing}); // sheets three voxels apart
  const DistanceField field = shapes::field(sdf, halfSide, voxels);
  for (const Vector3f& p : soundlyRemeshed(zeroLevel(field), field).mesh.vertices) {
    ASSERT_LT(distanceToLevel(field, p), .2) << "above sharp edges, for what the triangles across them cut off";
    if (std::abs(p.x()) < .6 && std::abs(p.y()) < .5) {
      ASSERT_NEAR(std::abs(p.z()), 1.5 * spacing, .1 * spacing);
    }
  }
}

TEST(Remesher, WhatSticksOutKeepsItsLength)
{
  // A horn on a ball, two voxels thick at its end. Sliding to the middle of its neighbors, a vertex at the tip gets to
  // the side of it; with nothing against that, twenty rounds take away two thirds of a voxel.
  const Vector3d axis = Vector3d(1, 2, 3).normalized();
  const shapes::Sdf horn = [&](const Vector3d& x) {
    const double along = std::min(std::max(axis.dot(x), 0.0), .8);
    return std::min(x.norm() - .4, (x - along * axis).norm() - (.3 - .3 * along));
  };
  const DistanceField field = shapes::field(horn, halfSide, voxels);
  const auto lengthOf = [&](const TriangleMesh& mesh) {
    float length = 0;
    for (const Vector3f& p : mesh.vertices)
      length = std::max(length, axis.cast<float>().dot(p));
    return length;
  };
  const TriangleMesh raw = zeroLevel(field);
  RemesherOptions options;
  options.rounds = 20;
  EXPECT_NEAR(lengthOf(soundlyRemeshed(raw, field, options).mesh), lengthOf(raw), .2 * spacing);
}

TEST(Remesher, OpenPatchKeepsItsCourseAndLosesItsTeeth)
{
  // A disc and one with a hole, cut out of a plane along the voxels' triangles, and a patch with four corners.
  const shapes::Sdf sdf = shapes::plane({.1, .2, 1});
  const DistanceField field = shapes::field(sdf, halfSide, voxels);
  const TriangleMesh whole = zeroLevel(field);
  const auto cut = [&](float inner, float outer) {
    return selectWhere(whole, [=](const Vector3f& p) { return p.norm() > inner && p.norm() < outer; });
  };
  for (const TriangleMesh& raw : {cut(0, .8f), cut(.3f, .8f), whole}) {
    const MeshStatistics before = measure(raw);
    SCOPED_TRACE(before.triangles);
    const RemeshResult result = soundlyRemeshed(raw, field);
    const MeshStatistics after = measure(result.mesh);
    EXPECT_GT(after.meanQuality, .92);
    EXPECT_GT(after.minQuality, .3) << "no slivers at the border";
    // Beside the corners of the volume the curve swings out of it by a little, and there the field is no plane.
    for (const Vector3f& p : result.mesh.vertices)
      ASSERT_LT(std::abs(sdf(p.cast<double>())), .02 * spacing);

    const auto formerBorder = boundaryOf(raw), border = boundaryOf(result.mesh);
    EXPECT_LT(farthest(result.mesh, border, raw, formerBorder), .5 * spacing);
    // A tooth may be as high as the curve goes away from it, and its side as long as that again.
    EXPECT_LT(farthest(raw, formerBorder, result.mesh, border), spacing);
    // What is gained and lost at teeth cancels out but for their mean.
    EXPECT_NEAR(after.area, before.area, .2 * spacing * lengthOf(raw, formerBorder));
    EXPECT_LT(lengthOf(result.mesh, border),
              (before.triangles == measure(whole).triangles ? 1 : .9) * lengthOf(raw, formerBorder));
  }
}

TEST(Remesher, TargetEdgeIsReached)
{
  const DistanceField field = shapes::field(shapes::sphere(.7), halfSide, voxels);
  const TriangleMesh raw = zeroLevel(field);
  for (const double voxelsPerEdge : {.5, 2.0}) {
    const RemesherOptions options = withTarget(voxelsPerEdge * spacing);
    const RemeshResult result = soundlyRemeshed(raw, field, options);
    const MeshStatistics after = measure(result.mesh);
    EXPECT_FLOAT_EQ(static_cast<float>(result.targetEdge), options.targetEdge);
    EXPECT_NEAR(after.meanEdge, options.targetEdge, .15 * options.targetEdge);
    EXPECT_GT(after.meanQuality, .92);
    for (const Vector3f& p : result.mesh.vertices)
      ASSERT_LT(distanceToLevel(field, p), .1);
  }
}

/// The lengths of the edges whose midpoint fulfills a condition.
template <typename Condition>
std::vector<double> edgesWhere(const TriangleMesh& mesh, const Condition& holds)
{
  std::vector<double> lengths;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3f &a = mesh.vertices[t[i]], &b = mesh.vertices[t[(i + 1) % 3]];
      if (holds((.5f * (a + b)).eval()))
        lengths.push_back((b - a).norm());
    }
  std::sort(lengths.begin(), lengths.end());
  return lengths;
}

/// A sizing with long edges where x > .2, as far as it may grow on the way there.
EdgeSizing longOnOneSide(const TriangleMesh& mesh, float size)
{
  EdgeSizing sizing;
  for (const Vector3f& p : mesh.vertices)
    sizing.push_back(p.x() > .2f ? size : 1);
  return sizing;
}

TEST(Remesher, EdgesAreAsLongAsTheirSizing)
{
  // A disc across the voxels, its border sized as well as its inside.
  const DistanceField field = shapes::field(shapes::plane({.1, .2, 1}), halfSide, 2 * voxels);
  const TriangleMesh raw = zeroLevel(field);
  const RemeshResult result = soundlyRemeshed(raw, field, {}, longOnOneSide(raw, 3));
  const MeshStatistics after = measure(result.mesh);
  EXPECT_GT(after.meanQuality, .93) << "between long and short edges, too";
  EXPECT_GT(after.minQuality, .3);

  const auto relative = [&](const std::vector<double>& lengths, double share) {
    return lengths[static_cast<std::size_t>(share * static_cast<double>(lengths.size()))] / result.targetEdge;
  };
  const std::vector<double> fine = edgesWhere(result.mesh, [](const Vector3f& p) { return p.x() < .1f; });
  EXPECT_NEAR(relative(fine, .5), 1, .1);
  EXPECT_LT(relative(fine, .98), 4. / 3);
  // Nine and more voxels away, edges have grown by a fifth of the way.
  const std::vector<double> coarse = edgesWhere(result.mesh, [](const Vector3f& p) { return p.x() > .7f; });
  EXPECT_NEAR(relative(coarse, .5), 3, .3);
  EXPECT_GT(relative(coarse, .02), 3 * 3. / 5);
}

TEST(Remesher, LongEdgesKeepTheTopologyOnAnyNumberOfThreads)
{
  for (const Case& shape : closedShapes()) {
    SCOPED_TRACE(shape.name);
    const DistanceField field = shapes::field(shape.sdf, halfSide, voxels);
    const TriangleMesh raw = zeroLevel(field);
    const EdgeSizing sizing = longOnOneSide(raw, 4);
    const TriangleMesh mesh = soundlyRemeshed(raw, field, {}, sizing).mesh;
    EXPECT_LT(mesh.triangles.size(), .9 * static_cast<double>(raw.triangles.size()));
    expectSame(remeshed(raw, field, {}, sizing, 3).mesh, mesh);
  }
}

TEST(Remesher, ATargetEdgeThatIsGivenGoesForAllEdges)
{
  const DistanceField field = shapes::field(shapes::sphere(.7), halfSide, voxels);
  const TriangleMesh raw = zeroLevel(field);
  const RemesherOptions options = withTarget(spacing);
  expectSame(remeshed(raw, field, options, longOnOneSide(raw, 4)).mesh, remeshed(raw, field, options).mesh);
  const EdgeSizing even(raw.vertices.size(), 1);
  expectSame(remeshed(raw, field, {}, even).mesh, remeshed(raw, field).mesh);
}

TEST(Remesher, EdgesKeepTheirLengthWhereThereAreLargerVoxels)
{
  // Two boxes in the middle have the smaller voxels; most triangles of the sphere are outside of them.
  std::mt19937 random(2);
  const auto sphere = [](const Vector3f& x) { return (x - Vector3f(15.5f, 15.5f, 15.5f)).norm() - 12; };
  const DistanceField field = bands::nested(random, sphere);
  EXPECT_NEAR(remeshed(zeroLevel(field), field).targetEdge, .6, .1) << "as of a mesh in voxels 1 wide";
}

RemesherOptions withTriangles(std::int64_t triangles)
{
  RemesherOptions options;
  options.triangles = triangles;
  return options;
}

TEST(Remesher, HasAsManyTrianglesAsAskedFor)
{
  for (const Case& shape : closedShapes()) {
    SCOPED_TRACE(shape.name);
    const DistanceField field = shapes::field(shape.sdf, halfSide, voxels);
    const TriangleMesh raw = zeroLevel(field);
    for (const int triangles : {300, 2000, 20000}) { // fewer and more than the raw mesh has
      SCOPED_TRACE(triangles);
      const TriangleMesh mesh = soundlyRemeshed(raw, field, withTriangles(triangles)).mesh;
      EXPECT_NEAR(static_cast<double>(mesh.triangles.size()), triangles, .02 * triangles);
      expectSame(remeshed(raw, field, withTriangles(triangles), {}, 3).mesh, mesh);
    }
  }
}

/// The mean distance of triangle centroids from a shape, weighted by area.
double meanDistance(const TriangleMesh& mesh, const shapes::Sdf& sdf)
{
  double sum = 0, area = 0;
  for (const Triangle& t : mesh.triangles) {
    const double own = areaOf(mesh, t);
    sum += own * std::abs(sdf(middleOf(mesh, t)));
    area += own;
  }
  return sum / area;
}

TEST(Remesher, FewTrianglesAreWhereTheSurfaceCurves)
{
  const shapes::Sdf box = shapes::box({.7, .5, .6}, .25);
  const DistanceField field = shapes::field(box, halfSide, 2 * voxels);
  const TriangleMesh raw = zeroLevel(field);
  const TriangleMesh even = soundlyRemeshed(raw, field, withTarget(4 * spacing)).mesh;
  const auto triangles = static_cast<std::int64_t>(even.triangles.size());
  const TriangleMesh mesh = soundlyRemeshed(raw, field, withTriangles(triangles)).mesh;
  EXPECT_LT(meanDistance(mesh, box), .5 * meanDistance(even, box)) << triangles << " triangles";
}

TEST(Remesher, FewTrianglesAreWhereDistancesWeighMore)
{
  const DistanceField field = shapes::field(shapes::sphere(.7), halfSide, 2 * voxels);
  const TriangleMesh raw = zeroLevel(field);
  const auto weighted = [&](double onOneSide) {
    Execution execution(2);
    return remesh(raw, field, {}, withTriangles(1000), execution, 0,
                  [=](const Vector3f& p) { return p.x() > 0 ? onOneSide : 1; });
  };
  const RemeshResult result = weighted(64);
  expectSound(measure(result.mesh));
  EXPECT_EQ(result.intersecting, 0);
  EXPECT_NEAR(static_cast<double>(result.mesh.triangles.size()), 1000, 20);
  const auto median = [](const std::vector<double>& lengths) { return lengths[lengths.size() / 2]; };
  const double longer = median(edgesWhere(result.mesh, [](const Vector3f&p) { return p.x() < -.2f; })),
               shorter = median(edgesWhere(result.mesh, [](const Vector3f&p) { return p.x() > .2f; }));
  EXPECT_NEAR(longer / shorter, 2, .3) << "an error is as the square of the edge, their number its inverse";
  expectSame(weighted(1).mesh, remeshed(raw, field, withTriangles(1000)).mesh);
}

TEST(Remesher, FewTrianglesKeepTheBorder)
{
  const DistanceField field = shapes::field(shapes::plane({.1, .2, 1}), halfSide, voxels);
  const TriangleMesh raw = zeroLevel(field);
  const TriangleMesh whole = soundlyRemeshed(raw, field).mesh;
  const TriangleMesh mesh = soundlyRemeshed(raw, field, withTriangles(60)).mesh;
  EXPECT_LE(mesh.triangles.size(), 60u);
  EXPECT_LT(farthest(mesh, boundaryOf(mesh), whole, boundaryOf(whole)), .5 * spacing);
  EXPECT_NEAR(measure(mesh).area, measure(whole).area, .01 * measure(whole).area);
}

TEST(Remesher, AMeshOfThePolygonizerHasAsManyTrianglesAsAskedForWithoutRounds)
{
  const DistanceField field = shapes::field(shapes::torus(.6, .25), halfSide, voxels);
  RemesherOptions options = withTriangles(500);
  options.rounds = 0;
  const RemeshResult result = soundlyRemeshed(zeroLevel(field), field, options);
  EXPECT_EQ(result.mesh.triangles.size(), 500u);
  EXPECT_EQ(result.splits, 0);
}

TEST(Remesher, HugeTargetEdgeKeepsTheTopology)
{
  for (const Case& shape : closedShapes()) {
    SCOPED_TRACE(shape.name);
    const DistanceField field = shapes::field(shape.sdf, halfSide, 16);
    const TriangleMesh raw = zeroLevel(field), mesh = soundlyRemeshed(raw, field, withTarget(100)).mesh;
    EXPECT_LT(mesh.triangles.size(), .5 * static_cast<double>(raw.triangles.size()));
  }
}

namespace {

/// The part of a mesh outside of a few random balls; where fans touch at a vertex, each gets a copy of it.
TriangleMesh cutAtRandom(const TriangleMesh& mesh, std::mt19937& random)
{
  std::uniform_real_distribution<double> coordinate(-.9, .9), radius(.1, .4);
  TriangleMesh result = mesh;
  for (int ball = 0; ball < 6; ++ball) {
    const Vector3d center(coordinate(random), coordinate(random), coordinate(random));
    const double r = radius(random);
    result = selectWhere(result, [&](const Vector3f& p) { return (p.cast<double>() - center).norm() >= r; });
  }
  splitFans(result);
  return result;
}

/// Surfaces with more than one sheet within a voxel or two, drawn at random.
shapes::Sdf crowdedShape(const std::string& kind, double h, std::mt19937& random)
{
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> share(0, 1);
  const Vector3d n = Vector3d(normal(random), normal(random), normal(random)).normalized();
  const double gap = h * (.4 + 2 * share(random)), bend = .4 * share(random);
  if (kind == "sheets") // slabs with gaps like themselves
    return [=](const Vector3d& x) { return gap / M_PI * std::sin(M_PI / gap * (n.dot(x) + bend * x.squaredNorm())); };
  if (kind == "crossing planes")
    return [=](const Vector3d& x) {
      const double a = n.dot(x), b = n.unitOrthogonal().dot(x) + bend * a;
      return a * b / (std::abs(a) + std::abs(b) + 1e-3);
    };
  if (kind == "flat ellipsoid")
    return [=](const Vector3d& x) {
      const double along = n.dot(x);
      const Vector3d y = (x - along * n) / .8 + n * (along / gap);
      return (y.norm() - 1) * gap;
    };
  if (kind == "shells")
    return [=](const Vector3d& x) { return gap / M_PI * std::sin(M_PI / gap * (x - .1 * n).norm()); };
  if (kind == "waves") { // many handles, necks and sheets within a voxel of each other
    const Eigen::Matrix<double, 40, 3> waves =
        Eigen::Matrix<double, 40, 3>::NullaryExpr([&] { return 6 * normal(random); });
    const Eigen::Array<double, 40, 1> phases =
        Eigen::Array<double, 40, 1>::NullaryExpr([&] { return 6 * normal(random); });
    return [=](const Vector3d& x) { return std::max(x.norm() - .9, .02 * ((waves * x).array() + phases).cos().sum()); };
  }
  const auto salt = static_cast<std::uint32_t>(random());
  return [=](const Vector3d& x) { // noise by voxel
    const Eigen::Matrix<std::uint32_t, 3, 1> at = ((x / h).array() + 64).floor().cast<std::uint32_t>();
    std::uint32_t hash = (at.x() * 73856093u) ^ (at.y() * 19349663u) ^ (at.z() * 83492791u) ^ salt;
    hash = (hash ^ (hash >> 15)) * 2246822519u;
    hash = (hash ^ (hash >> 13)) * 3266489917u;
    return std::max(x.norm() - .6, h * (static_cast<double>(hash >> 8) / (1 << 24) - .4));
  };
}

} // namespace

TEST(IntersectionWatch, LooksEverywhereWhereMuchIsCrowded)
{
  using Place = IntersectionWatch::Place;
  const DistanceField field = shapes::field(shapes::sphere(.7), halfSide, voxels);
  for (const float share : {0.f, .15f, .4f}) { // whose normals tell of folds
    HalfEdgeMesh mesh(zeroLevel(field), serial);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      const Vector3f& p = mesh.positions[v];
      mesh.normals[v] = (v % 2 == 0 && p.z() > .7f * (1 - 2 * share) ? -1 : 1) * p.normalized();
    }
    const auto edge = static_cast<float>(spacing);
    EXPECT_EQ(IntersectionWatch(Place::expected, mesh, edge, serial).place(),
              share > .3f ? Place::everywhere : Place::expected);
    EXPECT_EQ(IntersectionWatch(Place::everywhere, mesh, edge, serial).place(), Place::everywhere);
  }
}

TEST(Remesher, CrowdedSurfacesGetNoIntersections)
{
  constexpr int side = 16;
  constexpr double h = 2 * halfSide / side;
  std::int64_t before = 0;
  for (const std::string kind : {"sheets", "crossing planes", "flat ellipsoid", "shells", "waves", "noise"}) {
    double quality = 0;
    int runs = 0;
    for (unsigned seed = 1; seed <= 4; ++seed) {
      SCOPED_TRACE(testing::Message() << kind << ", seed " << seed);
      std::mt19937 random(seed);
      const DistanceField field = shapes::field(crowdedShape(kind, h, random), halfSide, side);
      TriangleMesh raw = zeroLevel(field);
      if (seed % 2 == 0)
        raw = cutAtRandom(raw, random);
      const RemeshResult result =
          soundlyRemeshed(raw, field, withTarget(seed % 3 == 1 ? 0 : (seed % 3 == 2 ? .5 : 2) * h));
      EXPECT_EQ(result.intersectingBefore, static_cast<std::int64_t>(selfIntersectingTriangles(raw).size()));
      before += result.intersectingBefore;
      quality += measure(result.mesh).meanQuality - measure(raw).meanQuality;
      ++runs;
    }
    // Noise by the voxel leaves few triangles that may change; the others gain .1 and more.
    EXPECT_GT(quality / runs, kind == "noise" ? 0 : .05) << kind;
  }
  EXPECT_GT(before, 0) << "none of the cuts made two fans touch";
}

TEST(Remesher, BordersThatTouchComeApart)
{
  // Two sectors of a plane around one of its vertices, each with a copy of it.
  const shapes::Sdf sdf = shapes::plane({.1, .2, 1});
  const DistanceField field = shapes::field(sdf, halfSide, voxels);
  const TriangleMesh whole = zeroLevel(field);
  std::size_t middle = 0;
  for (std::size_t v = 0; v < whole.vertices.size(); ++v)
    if (whole.vertices[v].norm() < whole.vertices[middle].norm())
      middle = v;
  TriangleMesh raw;
  for (const float sign : {1.f, -1.f})
    append(raw, selectWhere(whole, [&](const Vector3f& at) {
             const Vector3f p = sign * (at - whole.vertices[middle]);
             return p.norm() < .5f && p.x() > .5f * std::abs(p.y());
           }));
  ASSERT_EQ(std::count(raw.vertices.begin(), raw.vertices.end(), whole.vertices[middle]), 2);
  ASSERT_FALSE(selfIntersectingTriangles(raw).empty());
  const RemeshResult result = soundlyRemeshed(raw, field);
  EXPECT_GT(measure(result.mesh).minQuality, .25);
  EXPECT_GT(result.intersectingBefore, 0);
}

TEST(Remesher, SheetsThatTheFieldDoesNotKnowDoNotFallIntoOne)
{
  // Two sheets that face the same way within a voxel, as no field has them: both are drawn to its zero level. That is
  // not expected anywhere, and found all the same.
  const DistanceField field = shapes::field(shapes::plane({.1, .2, 1}), halfSide, voxels);
  TriangleMesh raw;
  for (const float offset : {-.15f, .2f}) {
    TriangleMesh sheet = zeroLevel(field);
    for (Vector3f& p : sheet.vertices)
      p += offset * static_cast<float>(spacing) * Vector3f(.1f, .2f, 1).normalized();
    append(raw, sheet);
  }
  ASSERT_TRUE(selfIntersectingTriangles(raw).empty());
  const TriangleMesh mesh = soundlyRemeshed(raw, field).mesh;
  for (const int threads : {2, 4})
    expectSame(remeshed(raw, field, {}, {}, threads).mesh, mesh);
}

TEST(Remesher, IntersectionsOfTheInputDoNotSpread)
{
  // Two spheres that pass through each other, one field for both.
  const shapes::Sdf first = shapes::sphere(.4, {-.25, 0, 0}), second = shapes::sphere(.4, {.25, 0, 0});
  TriangleMesh raw = zeroLevel(shapes::field(first, halfSide, voxels));
  const TriangleMesh other = zeroLevel(shapes::field(second, halfSide, voxels));
  append(raw, other);

  const RemeshResult result = remeshed(raw, shapes::field(shapes::unite(first, second), halfSide, voxels));
  const MeshStatistics after = measure(result.mesh);
  expectSound(after);
  EXPECT_EQ(after.eulerCharacteristic, 4);
  EXPECT_GT(after.meanQuality, measure(raw).meanQuality);
  const std::vector<std::int32_t> former = selfIntersectingTriangles(raw),
                                  left = selfIntersectingTriangles(result.mesh);
  EXPECT_FALSE(former.empty());
  EXPECT_EQ(result.intersectingBefore, static_cast<std::int64_t>(former.size()));
  EXPECT_EQ(result.intersecting, static_cast<std::int64_t>(left.size()));
  const auto before = cornersOf(raw), corners = cornersOf(result.mesh);
  for (const std::int32_t t : left)
    EXPECT_TRUE(std::any_of(former.begin(), former.end(), [&](std::int32_t f) { return before[f] == corners[t]; }));
}

TEST(Remesher, TrianglesThatRunAgainstTheSurfaceStay)
{
  // One vertex of a sphere's mesh lies behind its neighbors.
  const DistanceField field = shapes::field(shapes::sphere(.7), halfSide, voxels);
  TriangleMesh raw = zeroLevel(field);
  Vector3f& moved = raw.vertices[raw.vertices.size() / 2];
  moved = .7f * (moved + 2.5f * static_cast<float>(spacing) * moved.unitOrthogonal()).normalized();
  std::vector<Vector3f> corners; // of what is folded over
  for (const Triangle& t : raw.triangles)
    if (normalOf(raw, t).dot(middleOf(raw, t)) < 0)
      for (const std::int32_t v : t)
        corners.push_back(raw.vertices[v]);
  ASSERT_FALSE(corners.empty());
  const auto stay = [&](double targetEdge) {
    const TriangleMesh mesh = remeshed(raw, field, withTarget(targetEdge)).mesh;
    return std::count_if(corners.begin(), corners.end(), [&](const Vector3f& corner) {
      return std::find(mesh.vertices.begin(), mesh.vertices.end(), corner) != mesh.vertices.end();
    });
  };
  EXPECT_EQ(stay(0), static_cast<std::ptrdiff_t>(corners.size()));
  EXPECT_LT(stay(2 * spacing), static_cast<std::ptrdiff_t>(corners.size())) << "small ones among large ones";
}

TEST(Remesher, NoRoundsOrNoTrianglesChangeNothing)
{
  const DistanceField field = shapes::field(shapes::torus(.6, .25), halfSide, 16);
  const TriangleMesh raw = zeroLevel(field);
  RemesherOptions options;
  options.rounds = 0;
  const RemeshResult result = remeshed(raw, field, options);
  expectSame(result.mesh, raw);
  EXPECT_EQ(result.splits + result.collapses + result.flips + result.refusedOperations, 0);
  EXPECT_TRUE(remeshed({}, field).mesh.triangles.empty());
  EXPECT_TRUE(remeshed({}, field).mesh.vertices.empty());
  EXPECT_TRUE(remeshed({}, {}).mesh.triangles.empty());
}

TEST(Remesher, SameBytesForAnyNumberOfThreads)
{
  // The finer mesh has several regions.
  for (const int side : {voxels, 4 * voxels}) {
    const DistanceField field = shapes::field(shapes::torus(.6, .25), halfSide, side);
    const TriangleMesh raw = zeroLevel(field);
    const auto vertices = static_cast<std::int32_t>(raw.vertices.size());
    ASSERT_EQ(vertices > 3 * HalfEdgeMesh::regionSize(vertices), side > voxels);
    RemesherOptions options;
    options.rounds = side > voxels ? 1 : 10;
    const RemeshResult reference = remeshed(raw, field, options);
    for (const int threads : {2, 4}) {
      const RemeshResult result = remeshed(raw, field, options, {}, threads);
      expectSame(result.mesh, reference.mesh);
      EXPECT_EQ(result.refusedOperations, reference.refusedOperations);
    }
  }
}

TEST(Remesher, RefusesBadMeshes)
{
  const DistanceField field = shapes::field(shapes::sphere(.7), halfSide, 8);
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  const auto expectRefused = [&](const std::vector<Triangle>& triangles) {
    mesh.triangles = triangles;
    EXPECT_THROW(remeshed(mesh, field), InvalidInput);
  };
  expectRefused({{0, 1, 2}, {0, 1, 3}});            // orientations disagree
  expectRefused({{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}); // three triangles on an edge
  expectRefused({{0, 1, 2}, {0, 3, 4}});            // one vertex in common
  expectRefused({{0, 1, 1}});
  expectRefused({{0, 1, 7}});
  expectRefused({{0, 1, -1}});
  mesh.vertices[2].x() = std::numeric_limits<float>::infinity();
  expectRefused({{0, 1, 2}});
  mesh.vertices[2] = {0, 1, 0};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_THROW(remeshed(mesh, {}), InvalidInput) << "no field";

  RemesherOptions options;
  options.rounds = 1001;
  EXPECT_THROW(remeshed({}, {}, options), InvalidOption);
}

TEST(Remesher, TooManyTrianglesAreRefused)
{
  const DistanceField field = shapes::field(shapes::sphere(.7), halfSide, 8);
  const std::string message =
      clouds::messageOf<ResourceLimit>([&] { remeshed(zeroLevel(field), field, withTarget(1e-6)); });
  EXPECT_NE(message.find("targetEdge"), std::string::npos) << message;
}

TEST(Remesher, EachPassAsksOnTheWayWhetherToGoOn)
{
  // Edges of a third of a voxel, so that one round has as many operations as ten of the raw mesh have.
  const DistanceField field = shapes::field(shapes::torus(.6, .25), halfSide, 2 * voxels);
  const ZeroLevel level(field, static_cast<float>(spacing / 4));
  RemeshedSurface surface(zeroLevel(field), level, serial);
  HalfEdgeMesh& mesh = surface.mesh;
  for (std::int32_t v = 0; v < mesh.vertexCount(); ++v)
    mesh.normals[v] = surface.level.normalAt(mesh.positions[v], Vector3f::UnitZ());
  surface.targetEdge = static_cast<float>(spacing / 6);
  // Each operation takes some microseconds; no more than these may pass without a call.
  constexpr std::int64_t operations = 5000;
  const auto expectAsked = [&](const auto& pass, const std::int64_t& done) {
    const std::int64_t before = done, calls = callsDuring(pass);
    ASSERT_GT(done - before, 2 * operations) << "too few to tell";
    EXPECT_GE(calls, (done - before) / operations);
  };
  const RemeshSummary& result = surface.result;
  for (int round = 0; round < 2; ++round)
    expectAsked([&](Execution& execution) { splitLongEdges(surface, execution); }, result.splits);
  expectAsked([&](Execution& execution) { flipEdges(surface, execution); }, result.flips);
  mesh.compact(serial);
  EXPECT_GE(callsDuring([&](Execution& execution) { relax(surface, execution); }), mesh.vertexCount() / operations);
  surface.targetEdge *= 2;
  expectAsked([&](Execution& execution) { collapseShortEdges(surface, execution); }, result.collapses);
  mesh.compact(serial);
  // Of decimation also while it collapses, and not only before.
  const auto decimateTo = [&](std::int64_t triangles) {
    return callsDuring([&](Execution& execution) { decimate(surface, triangles, execution); });
  };
  const std::int64_t preparing = decimateTo(mesh.halfEdgeCount()), before = result.collapses;
  const std::int64_t calls = decimateTo(500) - preparing, done = result.collapses - before;
  ASSERT_GT(done, 2 * operations) << "too few to tell";
  EXPECT_GE(calls, done / operations);
}

TEST(Remesher, StopsWhereverItAsks)
{
  // Open, so that borders are gone along as well.
  const DistanceField field = shapes::field(shapes::plane({.1, .2, 1}), halfSide, voxels);
  const TriangleMesh raw = zeroLevel(field);
  RemesherOptions options;
  options.rounds = 2;
  options.triangles = 1000;
  expectCancelledWhereverItAsks([&](Execution& execution) { remesh(raw, field, {}, options, execution); });
}

TEST(ZeroLevel, IsReachedOfLinearFieldsWhateverTheSlope)
{
  // d = s (n·x − c): gradient of length s, the zero level a plane.
  const Vector3d n = Vector3d(1, 2, 2) / 3;
  for (const double slope : {.1, 1.0, 7.0}) {
    const DistanceField field =
        shapes::field([&](const Vector3d& x) { return slope * (n.dot(x) - .2); }, halfSide, voxels);
    const Vector3f start(.1f, .1f, .1f); // n·start = 1/6, so 1/30 below
    const std::optional<Corner> reached = ZeroLevel(field, .1f).trace(start);
    ASSERT_TRUE(reached);
    const Vector3f end = reached->position;
    EXPECT_NEAR(n.dot(end.cast<double>()), .2, 1e-3 * spacing);
    // Straight along the gradient.
    EXPECT_LT(((end - start).cast<double>() - (.2 - n.dot(start.cast<double>())) * n).norm(), 1e-3 * spacing);
  }
}

TEST(ZeroLevel, IsNotReachedWhereItIsTooFarOrThereIsNone)
{
  const Vector3f start(.1f, .2f, .3f);
  const DistanceField sphere = shapes::field(shapes::sphere(.7), halfSide, voxels);
  EXPECT_FALSE(ZeroLevel(sphere, .1f).trace(start));
  EXPECT_TRUE(ZeroLevel(sphere, .5f).trace(start));
  const DistanceField constant = shapes::field([](const Vector3d&) { return 1.0; }, halfSide, 8);
  EXPECT_FALSE(ZeroLevel(constant, 10).trace(start));
}
