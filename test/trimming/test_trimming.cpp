// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/mesh_topology.h"
#include "mesh/self_intersection.h"
#include "mesh/vertex_fields.h"
#include "points/sampling_density.h"
#include "support/clouds.h"
#include "support/meshes.h"
#include "support/shapes.h"
#include "support/threads.h"
#include "trimming/trimming.h"

#include <pcl/surface/mrf/exceptions.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>
#include <stdexcept>
#include <tuple>

using namespace pcl::mrf;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

constexpr double spacing = .06;
constexpr double reach = 3 * spacing; // confidence ends here, as with the default dEmax

/// A surface with its points: the mesh carries confidences that fall from 1 at a point to 0 at `reach`.
struct Scene {
  TriangleMesh mesh;
  OrientedPoints observed;
  std::unique_ptr<NeighborSearch> search;

  Scene(const shapes::Sdf& sdf, const PointSet& points, int voxels = 34)
      : observed(shapes::oriented(points)), search(clouds::searchOf(points))
  {
    const DistanceField field = shapes::field(sdf, 1.2, voxels);
    mesh = meshes::zeroLevel(field);
    setNormals(mesh, field, serial);
    observed.spacings = localSpacings(points, measureNeighbors(points, *search, serial), serial);
    setConfidences(mesh, {observed, *search, static_cast<float>(reach), 0}, ConfidenceShape::linear, serial);
  }

  TrimResult trim(Trimming trimming, float maxHole, int threads = 1) const
  {
    TrimmingOptions options;
    options.kind = trimming;
    options.maxHole = maxHole;
    return trim(options, threads);
  }

  TrimResult trim(const TrimmingOptions& options, int threads = 1, float diagonal = 2) const
  {
    Execution execution(threads);
    const TrimResult result = pcl::mrf::trim(mesh, observed, *search, diagonal, options, execution);
    if (result.statistics)
      meshes::expectSame(*result.statistics, measure(result.mesh));
    return result;
  }
};

/// Points of the unit sphere without those closer than the first angle to +z, or than the second one to −z.
PointSet cappedSphere(double angleAbove, double angleBelow)
{
  return shapes::filter(shapes::sample(shapes::sphere(1), 1.2, spacing), [=](const Vector3f& x) {
    return x.z() < std::cos(angleAbove) && x.z() > -std::cos(angleBelow);
  });
}

/// The diameter of a missing cap as trimming estimates it: twice the chord from the pole to the rim.
double capDiameter(double angle)
{
  return 4 * std::sin(angle / 2);
}

/// The area of the part of the cap farther than `reach` from its rim. The triangles without support differ from it by
/// those across the end of the support, and by voxels near it that still have some.
double unsupportedCapArea(double angle)
{
  return 2 * M_PI * (1 - std::cos(angle - 2 * std::asin(reach / 2)));
}

/// The tolerance of that area: a band of one voxel diagonal along the rim, and gaps between the points there.
double capAreaTolerance(double angle)
{
  return 2 * M_PI * std::sin(angle) * (2.4 / 34 * std::sqrt(3.) + spacing);
}

void expectSound(const TriangleMesh& mesh)
{
  meshes::expectSound(measure(mesh));
  EXPECT_EQ(mesh.normals.size(), mesh.vertices.size());
  EXPECT_EQ(mesh.confidences.size(), mesh.vertices.size());
}

TEST(Trimming, keepsAHoleBelowTheLimitAndDropsItAbove)
{
  const double angle = .6, diameter = capDiameter(angle);
  const Scene scene(shapes::sphere(1), cappedSphere(angle, 0));
  const double area = measure(scene.mesh).area;

  const TrimResult kept = scene.trim(Trimming::holes, static_cast<float>(1.15 * diameter));
  EXPECT_EQ(kept.holesFilled, 1);
  EXPECT_EQ(kept.extrapolationsDropped, 0);
  EXPECT_EQ(kept.areaDropped, 0);
  EXPECT_NEAR(kept.largestHole, diameter, 2 * spacing); // points have gaps of about their spacing at the rim
  EXPECT_NEAR(kept.areaFilled, unsupportedCapArea(angle), capAreaTolerance(angle));
  EXPECT_TRUE(measure(kept.mesh).closed());
  EXPECT_EQ(kept.mesh.triangles, scene.mesh.triangles);

  const TrimResult dropped = scene.trim(Trimming::holes, static_cast<float>(.85 * diameter));
  EXPECT_EQ(dropped.holesFilled, 0);
  EXPECT_EQ(dropped.extrapolationsDropped, 1);
  EXPECT_EQ(dropped.largestHole, 0);
  EXPECT_NEAR(dropped.areaDropped, kept.areaFilled, 1e-9);
  const MeshStatistics s = measure(dropped.mesh);
  expectSound(dropped.mesh);
  EXPECT_EQ(s.boundaryLoops, 1);
  EXPECT_EQ(s.components, 1);
  EXPECT_EQ(s.eulerCharacteristic, 1);
  EXPECT_NEAR(s.area + dropped.areaDropped, area, 1e-4 * area);
}

TEST(Trimming, decidesOnEachHoleByItself)
{
  const Scene scene(shapes::sphere(1), cappedSphere(.45, .75));
  const TrimResult one = scene.trim(Trimming::holes, static_cast<float>((capDiameter(.45) + capDiameter(.75)) / 2));
  EXPECT_GE(one.holesFilled, 1); // and perhaps what the jagged rim of the other one encloses
  EXPECT_EQ(one.extrapolationsDropped, 1);
  EXPECT_NEAR(one.largestHole, capDiameter(.45), 2 * spacing);
  expectSound(one.mesh);
  EXPECT_EQ(measure(one.mesh).boundaryLoops, 1);
  // The large one was below.
  const auto isPole = [](double sign) {
    return [=](const Vector3f& x) { return (x - Vector3f(0, 0, static_cast<float>(sign))).norm() < .15f; };
  };
  EXPECT_TRUE(std::any_of(one.mesh.vertices.begin(), one.mesh.vertices.end(), isPole(1)));
  EXPECT_TRUE(std::none_of(one.mesh.vertices.begin(), one.mesh.vertices.end(), isPole(-1)));
}

TEST(Trimming, automaticLimitIsHalfTheDiagonal)
{
  const Scene small(shapes::sphere(1), cappedSphere(.4, 0)); // .79 across, the diagonal given is 2
  EXPECT_EQ(small.trim(Trimming::holes, 0).holesFilled, 1);
  const Scene large(shapes::sphere(1), cappedSphere(.7, 0)); // 1.37 across
  EXPECT_EQ(large.trim(Trimming::holes, 0).holesFilled, 0);
}

TEST(Trimming, supportedModeKeepsNoHole)
{
  const Scene scene(shapes::sphere(1), cappedSphere(.45, .75));
  const TrimResult result = scene.trim(Trimming::supported, 100);
  EXPECT_EQ(result.holesFilled, 0);
  EXPECT_EQ(result.extrapolationsDropped, 2);
  EXPECT_EQ(result.areaFilled, 0);
  expectSound(result.mesh);
  for (const Triangle& t : result.mesh.triangles)
    EXPECT_TRUE(std::any_of(t.begin(), t.end(),
                            [&](std::int32_t v) { return result.mesh.confidences[static_cast<std::size_t>(v)] > 0; }));
}

TEST(Trimming, noneKeepsEveryByte)
{
  const Scene scene(shapes::sphere(1), cappedSphere(.45, .75));
  const TrimResult result = scene.trim(Trimming::none, .01f);
  meshes::expectSame(result.mesh, scene.mesh);
  EXPECT_EQ(result.mesh.normals, scene.mesh.normals);
  EXPECT_EQ(result.mesh.confidences, scene.mesh.confidences);
  EXPECT_EQ(result.areaDropped, 0);
}

TEST(Trimming, dropsTheSheetAroundAPatchButFillsItsHole)
{
  const double half = .7, holeRadius = .3;
  const shapes::Sdf plane = shapes::plane({.1, -.2, 1});
  const PointSet points = shapes::filter(shapes::sample(plane, 1.1, spacing), [=](const Vector3f& x) {
    return std::abs(x.x()) < half && std::abs(x.y()) < half && x.norm() > holeRadius;
  });
  const Scene scene(plane, points);
  EXPECT_FALSE(measure(scene.mesh).closed());

  const TrimResult result = scene.trim(Trimming::holes, 1);
  // The hole, and perhaps a triangle or two that the jagged end of the support encloses.
  EXPECT_GE(result.holesFilled, 1);
  EXPECT_EQ(result.extrapolationsDropped, 1);
  EXPECT_NEAR(result.largestHole, 2 * holeRadius, 2 * spacing);
  EXPECT_NEAR(result.areaFilled, M_PI * std::pow(holeRadius - reach, 2),
              2 * M_PI * holeRadius * (2.4 / 34 * std::sqrt(3.) + spacing));
  EXPECT_LT(result.areaFilled, M_PI * holeRadius * holeRadius);
  expectSound(result.mesh);
  const MeshStatistics s = measure(result.mesh);
  EXPECT_EQ(s.boundaryLoops, 1);
  EXPECT_EQ(s.eulerCharacteristic, 1); // a disc
  // What is left ends between the patch and its support plus a voxel's diagonal.
  const double beyond = reach + 2.4 / 34 * std::sqrt(3.);
  for (const Vector3f& x : result.mesh.vertices)
    EXPECT_LT(std::max(std::abs(x.x()), std::abs(x.y())), half + beyond);
  EXPECT_GT(s.area, 4 * half * half);

  // The sheet is dropped however large a hole may be.
  EXPECT_EQ(scene.trim(Trimming::holes, 1000).extrapolationsDropped, 1);
}

/// Points of a square without those of a disc at the middle of an edge, or a little farther in.
PointSet bittenPatch(double half, double holeRadius, double holeX)
{
  return shapes::filter(shapes::sample(shapes::plane({0, 0, 1}), 1.1, spacing), [=](const Vector3f& x) {
    return std::abs(x.x()) < half && std::abs(x.y()) < half && std::hypot(x.x() - holeX, x.y()) > holeRadius;
  });
}

bool covers(const TriangleMesh& mesh, const Vector3f& position)
{
  // Vertices are a voxel apart at most.
  return std::any_of(mesh.vertices.begin(), mesh.vertices.end(),
                     [&](const Vector3f& v) { return (v - position).norm() < 2.4 / 34; });
}

TEST(Trimming, fillsAHoleThatANarrowNeckJoinsToTheOutside)
{
  // Of the hole's .4 the neck is .53 wide at the patch's edge, wider than what the support spans.
  const double half = .7, radius = .4, holeX = .4;
  const Scene scene(shapes::plane({0, 0, 1}), bittenPatch(half, radius, holeX));
  const Vector3f middle(static_cast<float>(holeX), 0, 0);
  const TrimResult filled = scene.trim(Trimming::holes, 1);
  expectSound(filled.mesh);
  EXPECT_TRUE(covers(filled.mesh, middle));
  EXPECT_EQ(measure(filled.mesh).eulerCharacteristic, 1) << "a disc";
  // Nothing is kept beyond the support around the patch, not even before the neck.
  const double beyond = reach + 2.4 / 34 * std::sqrt(3.);
  for (const Vector3f& x : filled.mesh.vertices)
    EXPECT_LT(std::max(std::abs(x.x()), std::abs(x.y())), half + beyond);

  EXPECT_FALSE(covers(scene.trim(Trimming::holes, .5f).mesh, middle)) << "wider than what is to be filled";
}

TEST(Trimming, theClosingDoesNotFillAWideBay)
{
  // Half a disc of .5 is missing at the edge: wider at its mouth than the gap.
  const Scene scene(shapes::plane({0, 0, 1}), bittenPatch(.7, .5, .7));
  TrimmingOptions options;
  options.maxGap = .6f;
  const TriangleMesh mesh = scene.trim(options).mesh;
  EXPECT_FALSE(covers(mesh, {.65f, 0, 0}));
  options.maxGap = 1e9f;
  EXPECT_EQ(scene.trim(options).mesh.triangles, mesh.triangles) << "the sheet goes on beyond the mesh's boundary";
  options.maxGap = 0;
  options.maxHole = 100;
  EXPECT_FALSE(covers(scene.trim(options).mesh, {1.1f, 0, 0})) << "the sheet goes on to the border, and is no bay";
}

TEST(Trimming, aStepInDepthIsNoHole)
{
  // The same gap of a whole across in a plane, and across a ramp of 63 degrees that nobody saw.
  const auto isFilled = [](float slope, float maxGap) {
    const shapes::Sdf ramp = [=](const Vector3d& x) {
      return (x.z() - std::min(std::max(slope * x.x(), -.5), .5)) / std::hypot(1, slope);
    };
    PointSet points = shapes::filter(shapes::sample(shapes::plane({0, 0, 1}), 1.1, spacing),
                                     [](const Vector3f& x) { return std::abs(x.x()) > .5f; });
    for (Vector3f& x : points.positions)
      x.z() += std::min(std::max(slope * x.x(), -.5f), .5f);
    const Scene scene(ramp, points);
    TrimmingOptions options;
    options.maxGap = maxGap;
    return covers(scene.trim(options, 1, 12).mesh, {0, 0, 0}); // gaps of up to 2.88
  };
  EXPECT_TRUE(isFilled(0, 0));
  EXPECT_FALSE(isFilled(2, 0));
  EXPECT_TRUE(isFilled(2, 2.88f)) << "unless it is asked for";
}

/// A scene that is trimmed with a diagonal of 6: gaps of up to 1.44 are filled unless the sensors show otherwise.
struct SensedScene : Scene {
  SensedScene(const shapes::Sdf& sdf, const PointSet& points) : Scene(sdf, points)
  {
    observed.spacings.assign(points.size(), .03f); // what is more than 28 of them wide is no narrow gap
  }

  /// At the origin.
  bool isFilled(const std::vector<Vector3f>& sensors, float maxGap = 0)
  {
    observed.sensors = sensors;
    TrimmingOptions options;
    options.maxGap = maxGap;
    return covers(trim(options, 1, 6).mesh, {0, 0, 0});
  }
};

TEST(Trimming, whatNoSensorCouldSeeIsNoHole)
{
  // Two strips of a plane, of which the sensor that saw something of them could see nothing between.
  const double slope = 10;
  const shapes::Sdf steep = shapes::plane({-slope, 0, 1});
  PointSet points =
      shapes::filter(shapes::sample(steep, 1.1, spacing), [](const Vector3f& x) { return std::abs(x.y()) > .5f; });
  SensedScene scene(steep, points);
  const Vector3f above(0, 0, 50), beside(-50, 0, 5), behind(50, 0, -5);
  EXPECT_TRUE(scene.isFilled({})) << "it may have been seen from beside";
  EXPECT_TRUE(scene.isFilled({beside}));
  EXPECT_TRUE(scene.isFilled({above, beside}));
  EXPECT_FALSE(scene.isFilled({above}));
  EXPECT_TRUE(scene.isFilled({above}, 1.4f)) << "unless it is asked for";
  EXPECT_TRUE(scene.isFilled({behind})) << "it has not seen the points";

  // Points of the rest of the view tell where the sensor was, as well as it does.
  for (const Vector3f& normal : {Vector3f(0, 0, 1), Vector3f(1, 0, .1f), Vector3f(0, 1, .1f), Vector3f(0, -1, .1f)})
    for (std::size_t i = 0; i < points.size() / 8; ++i) {
      scene.observed.positions.emplace_back(20.f + static_cast<float>(i), 0.f, 0.f);
      scene.observed.normals.push_back(normal.normalized());
      scene.observed.spacings.push_back(1);
    }
  EXPECT_FALSE(scene.isFilled({})) << "edge-on on all sides from above";
  for (std::size_t i = 0; i < points.size() / 8; ++i)
    scene.observed.normals[points.size() + i] = Vector3f(0, 0, -1);
  EXPECT_TRUE(scene.isFilled({})) << "no sensor can have seen all of this";
}

TEST(Trimming, partsOfAFillingAreJudgedEachByItself)
{
  // Two holes of a plane, joined by a narrow one: in the left one the plane goes on, in the right one is a balloon.
  const Vector3f left(-.6f, 0, 0), right(.6f, 0, 0);
  const shapes::Sdf bulging = shapes::unite(shapes::plane({0, 0, 1}), shapes::sphere(.35, {.6, 0, .3}));
  const PointSet points =
      shapes::filter(shapes::sample(shapes::plane({0, 0, 1}), 1.2, spacing), [&](const Vector3f& x) {
        return (x - left).norm() > .5f && (x - right).norm() > .5f && (std::abs(x.x()) > .3f || std::abs(x.y()) > .25f);
      });
  Scene scene(bulging, points);
  scene.observed.spacings.assign(points.size(), .045f); // by those the neck is narrow, and the balloon far away
  const TriangleMesh mesh = scene.trim(TrimmingOptions(), 1, 8).mesh;
  EXPECT_TRUE(covers(mesh, left));
  EXPECT_TRUE(covers(mesh, {0, 0, 0}));
  EXPECT_FALSE(covers(mesh, {.6f, 0, .65f}));
}

TEST(Trimming, whatTheOnlySensorSawThroughIsNoHole)
{
  // A disc below a hole of a plane, as wide as that.
  constexpr float radius = .5f, depth = .6f;
  PointSet points = bittenPatch(.9, 0, 0); // an open surface
  for (Vector3f& position : points.positions)
    if (position.norm() < radius)
      position.z() -= depth;
  SensedScene scene(shapes::plane({0, 0, 1}), points);
  const Vector3f above(0, 0, 5), farAbove(0, 0, 1e8f), beside(0, 3, 1.5f);
  EXPECT_TRUE(scene.isFilled({})) << "nothing is known";
  EXPECT_FALSE(scene.isFilled({above}));
  EXPECT_FALSE(scene.isFilled({farAbove}));
  EXPECT_TRUE(scene.isFilled({beside})) << "it looks past the disc";
  EXPECT_TRUE(scene.isFilled({above, beside})) << "the other one may have seen the disc";

  for (std::size_t i = 0; i < points.size(); ++i)
    if (points.positions[i].z() < -.5f * depth)
      scene.observed.normals[i] *= -1;
  EXPECT_TRUE(scene.isFilled({above})) << "it sees no backs";
}

TEST(Trimming, theBackOfWhatWasSeenFromOneSideIsNoHole)
{
  TrimmingOptions options;
  options.maxHole = 100;
  options.maxGap = .2f;
  // Without support: 16 % of the sphere, and 60 %.
  const Scene holed(shapes::sphere(1), cappedSphere(0, 1));
  EXPECT_TRUE(measure(holed.trim(options).mesh).closed());
  const Scene front(shapes::sphere(1), cappedSphere(0, 1.95));
  EXPECT_FALSE(measure(front.trim(options).mesh).closed());
  EXPECT_TRUE(measure(front.trim(Trimming::holes, 100).mesh).closed()) << "unless it is asked for";
}

TEST(Trimming, aBulbBehindTheEndOfATubeIsNoHole)
{
  // A capsule: its ends are half balls, as much as a hole may lack. What lacks more is no wider than half the diagonal.
  const auto endingAt = [](double below) {
    const shapes::Sdf tube = shapes::tube({0, 0, -.9}, {0, 0, .9}, .18);
    return Scene(
        tube, shapes::filter(shapes::sample(tube, 1.2, spacing), [=](const Vector3f& x) { return x.z() > below; }), 50);
  };
  TrimmingOptions options;
  EXPECT_TRUE(measure(endingAt(-.92).trim(options).mesh).closed());
  const Scene cut = endingAt(-.65);
  EXPECT_FALSE(measure(cut.trim(options).mesh).closed());
  options.maxHole = 1;
  EXPECT_TRUE(measure(cut.trim(options).mesh).closed()) << "as it was asked for";
}

TEST(Trimming, dropsComponentsWithoutOrWithLittleSupport)
{
  const shapes::Sdf large = shapes::sphere(.6, {-.45, 0, 0}), small = shapes::sphere(.2, {.8, 0, 0});
  const shapes::Sdf both = shapes::unite(large, small);
  const PointSet all = shapes::sample(both, 1.2, spacing);
  const PointSet largeOnly = shapes::filter(all, [](const Vector3f& x) { return x.x() < .3f; });

  const Scene unsupported(both, largeOnly);
  ASSERT_EQ(measure(unsupported.mesh).components, 2);
  const TrimResult withoutPoints = unsupported.trim(Trimming::holes, 100);
  EXPECT_EQ(withoutPoints.extrapolationsDropped, 1);
  EXPECT_EQ(measure(withoutPoints.mesh).components, 1);
  EXPECT_TRUE(measure(withoutPoints.mesh).closed());
  EXPECT_NEAR(withoutPoints.areaDropped, 4 * M_PI * .04,
              .05 * 4 * M_PI * .04); // faceting of a sphere 3 voxels in radius

  const Scene supported(both, all);
  const TrimResult kept = supported.trim(Trimming::holes, 100);
  EXPECT_EQ(kept.componentsDropped, 0);
  EXPECT_EQ(measure(kept.mesh).components, 2);
  EXPECT_TRUE(kept.statistics.has_value()) << "all was kept, so there is nothing left to measure";

  // Points whose normals do not agree are no support. Of twenty directions no two are within 40°.
  PointSet torn = all;
  std::mt19937 generator(1);
  for (std::size_t i = 0; i < torn.size(); ++i)
    if (torn.positions[i].x() >= .3f) {
      const auto n = static_cast<float>(generator() % 20);
      const float z = .95f - .1f * n, angle = 2.399963f * n;
      torn.normals[i] << std::sqrt(1 - z * z) * std::cos(angle), std::sqrt(1 - z * z) * std::sin(angle), z;
    }
  const Scene incoherent(both, torn);
  for (const Trimming mode : {Trimming::holes, Trimming::supported}) {
    const TrimResult dropped = incoherent.trim(mode, 100);
    EXPECT_EQ(dropped.componentsDropped, 1);
    EXPECT_FALSE(dropped.statistics.has_value());
    EXPECT_EQ(measure(dropped.mesh).components, 1);
    EXPECT_NEAR(dropped.areaDropped, 4 * M_PI * .04, .05 * 4 * M_PI * .04);
  }
}

TEST(Trimming, dropsBubblesAroundSinglePointsHoweverLarge)
{
  // A bubble of a third of the main surface's area around one point, and an object of a fortieth that is full of them.
  const shapes::Sdf large = shapes::sphere(.3, {-.6, 0, 0}), bubble = shapes::sphere(.17, {.2, 0, 0}),
                    object = shapes::sphere(.11, {.7, 0, 0});
  PointSet points = shapes::sample(shapes::unite(large, object), 1.2, spacing);
  clouds::append(points, {.2f, 0, 0}, Vector3f::UnitZ());
  const Scene scene(shapes::unite(shapes::unite(large, bubble), object), points, 60);
  ASSERT_EQ(measure(scene.mesh).components, 3);
  TrimmingOptions all;
  all.maxHole = 100;
  all.minComponentPoints = 0;
  ASSERT_EQ(measure(scene.trim(all).mesh).components, 3);
  const TrimResult result = scene.trim(Trimming::holes, 100);
  EXPECT_EQ(result.componentsDropped, 1);
  EXPECT_EQ(measure(result.mesh).components, 2);
  for (const Vector3f& v : result.mesh.vertices)
    EXPECT_TRUE(v.x() < 0 || v.x() > .5f);
}

TEST(Trimming, aSurfaceThroughWhichALargerOneWasSeenIsNone)
{
  // A ball of a few sparse points before a larger one, both seen from above.
  const shapes::Sdf large = shapes::sphere(.5, {0, 0, -.6}), match = shapes::sphere(.2, {0, 0, .9});
  PointSet points = shapes::sample(large, 1.2, spacing / 2);
  for (int n = 0; n < 25; ++n) {
    const Vector3f normal =
        Vector3f(.25f * static_cast<float>(n % 5 - 2), .25f * static_cast<float>(n / 5 - 2), 1).normalized();
    clouds::append(points, Vector3f(0, 0, .9f) + .2f * normal, normal);
  }
  Scene scene(shapes::unite(large, match), points, 60);
  ASSERT_EQ(measure(scene.mesh).components, 2);
  EXPECT_EQ(scene.trim(Trimming::holes, 100).componentsDropped, 0) << "without a sensor it may be one";
  scene.observed.sensors = {{0, 0, 4}};
  const TrimResult result = scene.trim(Trimming::holes, 100);
  EXPECT_EQ(result.componentsDropped, 1);
  EXPECT_TRUE(covers(result.mesh, {0, 0, -.1f}));
  TrimmingOptions all;
  all.maxHole = 100;
  all.minComponentPoints = 0;
  EXPECT_EQ(scene.trim(all).componentsDropped, 0);
}

TEST(Trimming, aFewCoherentPointsAreASurfaceAndManyThatDisagreeAreNone)
{
  // Two bubbles as large: at the left 20 points whose normals point anywhere, at the right four in a row that agree.
  const shapes::Sdf large = shapes::sphere(.3, {0, -.6, 0}), left = shapes::sphere(.17, {-.5, .5, 0}),
                    right = shapes::sphere(.17, {.5, .5, 0});
  PointSet points = shapes::sample(large, 1.2, spacing);
  std::mt19937 random(1);
  const auto uniform = [&] { return static_cast<float>(random()) / 2147483648.f - 1; };
  const auto anywhere = [&] { return Vector3f(uniform(), uniform(), uniform()).normalized(); };
  for (int n = 0; n < 20; ++n) {
    const Vector3f position = Vector3f(-.5f, .5f, 0) + .17f * anywhere();
    clouds::append(points, position, anywhere());
  }
  for (int n = 0; n < 4; ++n) {
    const auto angle = .3f * static_cast<float>(n);
    const Vector3f normal(std::sin(angle), 0, std::cos(angle));
    clouds::append(points, Vector3f(.5f, .5f, 0) + .17f * normal, normal);
  }
  const Scene scene(shapes::unite(shapes::unite(large, left), right), points, 60);
  ASSERT_EQ(measure(scene.mesh).components, 3);
  const TrimResult result = scene.trim(Trimming::holes, 100);
  EXPECT_EQ(result.componentsDropped, 1);
  EXPECT_TRUE(covers(result.mesh, {.5f, .5f, .17f}));
  EXPECT_FALSE(covers(result.mesh, {-.5f, .5f, .17f}));
}

TEST(Trimming, aFewPointsMuchFartherApartThanThoseNextToThemAreNoSurface)
{
  // A square of four points whose normals agree, as estimated ones do, on a bubble: an object's corner if its sides are
  // of the order of the surface's spacing, but as many outliers if they are eight times as long.
  const shapes::Sdf large = shapes::sphere(.3, {0, -.75, 0}), bubble = shapes::sphere(.36, {0, .5, 0});
  const auto componentsDropped = [&](float spacings) {
    PointSet points = shapes::sample(large, 1.2, spacing);
    const float half = spacings * static_cast<float>(spacing) / 2;
    for (const float x : {-half, half})
      for (const float y : {-half, half})
        clouds::append(points, {x, .5f + y, std::sqrt(.36f * .36f - 2 * half * half)}, Vector3f::UnitZ());
    return Scene(shapes::unite(large, bubble), points, 60).trim(Trimming::holes, 100).componentsDropped;
  };
  EXPECT_EQ(componentsDropped(2), 0);
  EXPECT_EQ(componentsDropped(8), 1);
}

TEST(Trimming, pointsOfASurfaceBesideItDoNotStandBehindABubble)
{
  // The bubble around one point is half a spacing away from the plane: the nearest points of its lower half are the
  // plane's, more than a dozen.
  const shapes::Sdf plane = shapes::plane({0, 0, 1}), bubble = shapes::sphere(.15, {0, 0, .18});
  PointSet points = shapes::sample(plane, 1.1, spacing);
  clouds::append(points, {0, 0, .18f}, Vector3f::UnitZ());
  const Scene scene(shapes::unite(plane, bubble), points, 160);
  ASSERT_EQ(measure(scene.mesh).components, 2);
  const TrimResult result = scene.trim(Trimming::holes, 100);
  EXPECT_EQ(result.componentsDropped, 1);
  for (const Vector3f& v : result.mesh.vertices)
    EXPECT_LT(v.z(), .02f);
}

TEST(Trimming, theLargestComponentStaysHoweverFewItsPoints)
{
  PointSet points;
  for (const float x : {-.05f, .05f, .6f})
    clouds::append(points, {x, 0, 0}, Vector3f::UnitX());
  const Scene scene(shapes::unite(shapes::sphere(.15), shapes::sphere(.1, {.6, 0, 0})), points, 60);
  ASSERT_EQ(measure(scene.mesh).components, 2);
  const TrimResult result = scene.trim(Trimming::holes, 100);
  EXPECT_EQ(result.componentsDropped, 1);
  ASSERT_EQ(measure(result.mesh).components, 1);
  EXPECT_LT(result.mesh.vertices.front().x(), .3f);
}

TEST(Trimming, withoutAnySupportNothingIsLeft)
{
  Scene scene(shapes::sphere(1), cappedSphere(.6, 0));
  std::fill(scene.mesh.confidences.begin(), scene.mesh.confidences.end(), 0.f);
  const TrimResult result = scene.trim(Trimming::holes, 100);
  EXPECT_TRUE(result.mesh.triangles.empty());
  EXPECT_TRUE(result.mesh.vertices.empty());
  EXPECT_EQ(result.extrapolationsDropped, 1);
}

/// Random confidences tear the mesh into pieces that touch at corners everywhere.
TEST(Trimming, staysManifoldHoweverTorn)
{
  Scene scene(shapes::torus(.7, .3), shapes::sample(shapes::torus(.7, .3), 1.2, .1), 20);
  std::mt19937 random(5);
  for (const double share : {.15, .3, .5, .7}) {
    SCOPED_TRACE(share);
    std::bernoulli_distribution isSupported(share);
    for (float& confidence : scene.mesh.confidences)
      confidence = isSupported(random) ? std::uniform_real_distribution<float>(.1f, 1)(random) : 0;
    TrimmingOptions options;
    options.kind = Trimming::supported;
    options.minComponentPoints = 0;
    const TrimResult result = scene.trim(options);
    expectSound(result.mesh);
    EXPECT_FALSE(measure(result.mesh).closed());

    // Vertices were duplicated, with their fields, and triangles neither lost nor turned.
    const auto corner = [](const TriangleMesh& mesh, std::int32_t v) {
      const auto n = static_cast<std::size_t>(v);
      return std::array<float, 7>{mesh.vertices[n].x(), mesh.vertices[n].y(), mesh.vertices[n].z(), mesh.normals[n].x(),
                                  mesh.normals[n].y(),  mesh.normals[n].z(),  mesh.confidences[n]};
    };
    std::size_t next = 0;
    for (const Triangle& t : scene.mesh.triangles) {
      const auto confidence = [&](std::size_t c) { return scene.mesh.confidences[static_cast<std::size_t>(t[c])]; };
      if (confidence(0) + confidence(1) + confidence(2) == 0)
        continue;
      ASSERT_LT(next, result.mesh.triangles.size());
      const Triangle& kept = result.mesh.triangles[next++];
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_EQ(corner(result.mesh, kept[c]), corner(scene.mesh, t[c]));
    }
    EXPECT_EQ(next, result.mesh.triangles.size());
    std::set<std::array<float, 7>> distinct;
    for (std::size_t v = 0; v < result.mesh.vertices.size(); ++v)
      distinct.insert(corner(result.mesh, static_cast<std::int32_t>(v)));
    if (share < .5) {
      EXPECT_LT(distinct.size(), result.mesh.vertices.size()); // there were corners to separate
    }
  }
}

TEST(Trimming, dropsTrianglesThatAreNone)
{
  Scene scene(shapes::sphere(1), cappedSphere(.45, .75));
  for (const Trimming mode : {Trimming::holes, Trimming::supported}) {
    const TrimResult expected = scene.trim(mode, 1.3f);
    Scene broken(shapes::sphere(1), cappedSphere(.45, .75));
    const std::int32_t count = static_cast<std::int32_t>(broken.mesh.vertices.size());
    for (const Triangle& bad : {Triangle{0, 1, 1}, Triangle{0, 1, count}, Triangle{-1, 0, 1}})
      broken.mesh.triangles.push_back(bad);
    const TrimResult result = broken.trim(mode, 1.3f);
    meshes::expectSame(result.mesh, expected.mesh);
    EXPECT_EQ(result.extrapolationsDropped, expected.extrapolationsDropped);
    EXPECT_EQ(result.holesFilled, expected.holesFilled);
  }
}

TEST(Trimming, doesNotDependOnThreads)
{
  const Scene scene(shapes::sphere(1), cappedSphere(.45, .75));
  sameOnAnyThreads([&](int threads) {
    const TrimResult r = scene.trim(Trimming::holes, 1.3f, threads);
    return std::make_tuple(r.mesh.vertices, r.mesh.triangles, r.mesh.confidences, r.areaDropped, r.largestHole);
  });
}

/// The angles from +z of the border's vertices on the upper half of the unit sphere, each vertex twice.
std::vector<double> anglesOfUpperBorder(const TriangleMesh& mesh)
{
  std::vector<double> angles;
  for (const auto& edge : meshes::boundaryOf(mesh))
    for (const std::int32_t v : {edge.first, edge.second})
      if (const Vector3f& x = mesh.vertices[static_cast<std::size_t>(v)]; x.z() > 0)
        angles.push_back(std::atan2(x.head<2>().norm(), x.z()));
  return angles;
}

double meanOf(const std::vector<double>& values)
{
  return std::accumulate(values.begin(), values.end(), 0.) / static_cast<double>(values.size());
}

/// Drops the triangles all of whose corners meet the condition.
template <typename Condition>
void dropWhere(TriangleMesh& mesh, const Condition& holds)
{
  const auto isInside = [&](const Triangle& t) {
    return std::all_of(t.begin(), t.end(),
                       [&](std::int32_t v) { return holds(mesh.vertices[static_cast<std::size_t>(v)]); });
  };
  mesh.triangles.erase(std::remove_if(mesh.triangles.begin(), mesh.triangles.end(), isInside), mesh.triangles.end());
}

TEST(TightenBorders, endsTheSurfaceAtTheLastPoints)
{
  constexpr double angle = .8;
  for (const int voxels : {14, 40}) { // some three times as wide as the spacing, and as wide
    const Scene scene(shapes::sphere(1), cappedSphere(angle, .6), voxels);
    const Support support(scene.observed, *scene.search, static_cast<float>(reach), 0);
    TriangleMesh mesh = scene.trim(Trimming::supported, 100).mesh;
    EXPECT_GT(angle - meanOf(anglesOfUpperBorder(mesh)), 1.5 * spacing) << "else there is nothing to see";
    EXPECT_GT(tightenBorders(mesh, support, serial), 0);
    expectSound(mesh);
    EXPECT_TRUE(selfIntersectingTriangles(mesh).empty());
    EXPECT_EQ(measure(mesh).components, 1);
    EXPECT_EQ(measure(mesh).boundaryLoops, 2);
    const std::vector<double> angles = anglesOfUpperBorder(mesh);
    EXPECT_NEAR(meanOf(angles), angle, .5 * spacing);
    EXPECT_GT(*std::min_element(angles.begin(), angles.end()), angle - 1.5 * spacing);
    EXPECT_LT(*std::max_element(angles.begin(), angles.end()), angle + spacing);
    for (const Triangle& t : mesh.triangles)
      EXPECT_GT(TriangleCorners(mesh, t).cross().dot(TriangleCorners(mesh, t).a), 0);
  }
}

TEST(TightenBorders, leavesClosedMeshesAndFillingsWithPointsToBothSides)
{
  const Scene scene(shapes::sphere(1), cappedSphere(.6, 0));
  const Support support(scene.observed, *scene.search, static_cast<float>(reach), 0);
  TriangleMesh closed = scene.mesh;
  EXPECT_EQ(tightenBorders(closed, support, serial), 0);
  EXPECT_EQ(closed.vertices, scene.mesh.vertices);
  // The middle of the filling is cut away by hand, far from the points.
  TriangleMesh holed = scene.mesh;
  dropWhere(holed, [](const Vector3f& x) { return x.z() > .98f; });
  ASSERT_LT(holed.triangles.size(), scene.mesh.triangles.size());
  const std::vector<Vector3f> before = holed.vertices;
  EXPECT_EQ(tightenBorders(holed, support, serial), 0);
  EXPECT_EQ(holed.vertices, before);
}

TEST(TightenBorders, keepsStripsNarrowerThanAVoxel)
{
  const Scene scene(shapes::plane({0, 0, 1}),
                    shapes::filter(shapes::sample(shapes::plane({0, 0, 1}), 1, spacing),
                                   [](const Vector3f& x) { return std::abs(x.x()) < 1.5 * spacing; }),
                    10);
  const Support support(scene.observed, *scene.search, static_cast<float>(reach), 0);
  TriangleMesh mesh = scene.trim(Trimming::supported, 100).mesh;
  ASSERT_GT(measure(mesh).meanEdge, 3 * spacing);
  tightenBorders(mesh, support, serial);
  EXPECT_GT(measure(mesh).area, .9 * 2 * 3 * spacing) << "as large as the strip";
  EXPECT_EQ(measure(mesh).components, 1);
}

TEST(TightenBorders, dropsFillingsThatStickOut)
{
  const Scene scene(shapes::plane({0, 0, 1}), shapes::filter(shapes::sample(shapes::plane({0, 0, 1}), 1.2, spacing),
                                                             [](const Vector3f& x) { return x.x() < 0; }));
  const Support support(scene.observed, *scene.search, static_cast<float>(reach), 0);
  TriangleMesh mesh = scene.mesh;
  dropWhere(mesh, [](const Vector3f& x) { return x.x() > reach && !(x.x() < .7f && std::abs(x.y()) < .3f); });
  const auto extent = [&] {
    float farthest = -1;
    for (const Triangle& t : mesh.triangles)
      for (const std::int32_t v : t)
        farthest = std::max(farthest, mesh.vertices[static_cast<std::size_t>(v)].x());
    return farthest;
  };
  EXPECT_GT(extent(), .6f);
  tightenBorders(mesh, support, serial);
  EXPECT_NEAR(extent(), 0, 2 * spacing);
}

TEST(Trimming, needsConfidences)
{
  Scene scene(shapes::sphere(1), cappedSphere(.6, 0), 16);
  scene.mesh.confidences.clear();
  EXPECT_THROW(scene.trim(Trimming::holes, 1), std::invalid_argument);
  EXPECT_NO_THROW(scene.trim(Trimming::none, 1));
  scene.mesh = TriangleMesh();
  EXPECT_TRUE(scene.trim(Trimming::holes, 1).mesh.triangles.empty());
}

Options limitedTo(float maxError)
{
  Options options;
  options.uncertainty.compute = maxError == 0;
  options.uncertainty.maxError = maxError;
  return options;
}

/// A sphere with a hole of radius .5 around +z, and noise.
PointSet holedSphere()
{
  PointSet points = shapes::sample(shapes::sphere(1), 1.2, .06);
  points = shapes::filter(points, [](const Eigen::Vector3f& p) { return (p - Eigen::Vector3f(0, 0, 1)).norm() > .5f; });
  shapes::addNoise(points, .003);
  return points;
}

/// A limit between the half-widths of nearly all measured surface and those of most of the filling.
float limitBetween(const UncertaintyReport& report)
{
  const double limit = halfWidthPerSigma * std::sqrt(report.measured.percentile95 * report.fillings.median);
  EXPECT_GT(halfWidthPerSigma * report.fillings.median, limit);
  return static_cast<float>(limit);
}

TEST(ErrorLimit, DropsTheFillingAndKeepsWhatWasMeasured)
{
  const Reconstruction whole = clouds::reconstruct(holedSphere(), limitedTo(0));
  ASSERT_TRUE(whole.report.mesh.closed()) << "the hole is filled";
  EXPECT_EQ(whole.report.beyondError.triangles, 0);
  const float limit = limitBetween(whole.report.uncertainty);
  const Reconstruction cut = clouds::reconstruct(holedSphere(), limitedTo(limit));

  for (const float sigma : cut.mesh.sigmas)
    ASSERT_LE(halfWidthPerSigma * static_cast<double>(sigma), 1.00001 * static_cast<double>(limit)) << "floats";
  EXPECT_GE(cut.report.mesh.boundaryLoops, 1);
  EXPECT_EQ(cut.report.mesh.components, 1);
  EXPECT_TRUE(cut.report.mesh.manifold());
  EXPECT_EQ(cut.report.mesh.unusedVertices, 0);
  bool isTopOpen = true;
  for (const Eigen::Vector3f& v : cut.mesh.vertices)
    isTopOpen = isTopOpen && (v.cast<double>() + cut.points.offset).z() < .95; // its rim is at .87
  EXPECT_TRUE(isTopOpen);
  EXPECT_GE(cut.report.uncertainty.measured.vertices, whole.report.uncertainty.measured.vertices * 19 / 20);
  EXPECT_LT(cut.report.uncertainty.fillings.vertices, whole.report.uncertainty.fillings.vertices);
  EXPECT_LE(cut.report.uncertainty.fillings.max, static_cast<double>(limit) / 1.95) << "of what is left";

  const ErrorLimitSummary& dropped = cut.report.beyondError;
  EXPECT_EQ(dropped.triangles, whole.report.mesh.triangles - cut.report.mesh.triangles);
  EXPECT_NEAR(dropped.area, whole.report.mesh.area - cut.report.mesh.area, 1e-6);
  EXPECT_LT(dropped.measuredArea, .5 * dropped.area);
  ASSERT_EQ(cut.report.warnings.size(), whole.report.warnings.size() + 1);
  EXPECT_NE(cut.report.warnings.back().find("uncertainty.maxError"), std::string::npos);
  EXPECT_FALSE(cut.report.uncertainty.shape.isClosed) << "what is drawn is what is left";
}

TEST(ErrorLimit, KeepsAllIfItIsWide)
{
  const Reconstruction whole = clouds::reconstruct(holedSphere(), limitedTo(0)),
                       wide = clouds::reconstruct(holedSphere(), limitedTo(100));
  EXPECT_EQ(wide.mesh.triangles, whole.mesh.triangles);
  EXPECT_EQ(wide.mesh.sigmas, whole.mesh.sigmas);
  EXPECT_EQ(wide.report.beyondError.triangles, 0);
  EXPECT_EQ(wide.report.warnings, whole.report.warnings);
}

TEST(ErrorLimit, LeavesNoEmptyMeshBehind)
{
  const std::string message =
      clouds::messageOf<InvalidOption>([&] { clouds::reconstruct(holedSphere(), limitedTo(1e-6f)); });
  EXPECT_NE(message.find("uncertainty.maxError = 1e-06"), std::string::npos) << message;
  EXPECT_NE(message.find("at best within"), std::string::npos) << message;
}

TEST(ErrorLimit, IsOnTopOfTrimming)
{
  // Half a sphere, all of its zero level kept: extrapolation goes by its error.
  const PointSet half = shapes::filter(holedSphere(), [](const Eigen::Vector3f& p) { return p.z() < 0; });
  Options options = limitedTo(0);
  options.trimming.kind = Trimming::none;
  const Reconstruction all = clouds::reconstruct(half, options);
  options.uncertainty.maxError = limitBetween(all.report.uncertainty);
  const Reconstruction cut = clouds::reconstruct(half, options);
  EXPECT_LT(cut.report.mesh.area, .9 * all.report.mesh.area);
  EXPECT_GT(cut.report.mesh.area, 2 * M_PI * .95) << "the half that has points";
}

TEST(ErrorLimit, LeavesNoSlivers)
{
  // A strip of two rows of vertices across an uncertain plane, a patch with a vertex inside, and a corner.
  const int side = 8;
  TriangleMesh mesh = meshes::squares(side);
  for (const Eigen::Vector3f& v : mesh.vertices) {
    const bool isStrip = v.y() <= 1 && v.x() > 0, isPatch = (v - Eigen::Vector3f(3, 5, 0)).cwiseAbs().maxCoeff() <= 1;
    mesh.confidences.push_back(1);
    mesh.sigmas.push_back(isStrip || isPatch ? 1.f : 3.f);
  }
  const ErrorLimitSummary dropped = limitSigma(mesh, 2);
  // The strip lies at the mesh's own border, where a vertex is inside with the triangles that it has.
  for (const Eigen::Vector3f& v : mesh.vertices)
    EXPECT_TRUE(v.y() <= 1 || (v.y() >= 4 && v.y() <= 6 && v.x() >= 2 && v.x() <= 4)) << v.transpose();
  EXPECT_EQ(
      std::count_if(mesh.vertices.begin(), mesh.vertices.end(), [](const Eigen::Vector3f& v) { return v.y() > 3; }), 7)
      << "around the middle of the patch; its other two corners hang on by one triangle each";
  EXPECT_EQ(dropped.triangles + static_cast<std::int64_t>(mesh.triangles.size()), 2 * side * side);
  EXPECT_NEAR(dropped.area, .5 * static_cast<double>(dropped.triangles), 1e-6);
  EXPECT_NEAR(dropped.measuredArea, dropped.area, 1e-6);

  // Two rows amid others: no vertex has all of its triangles.
  TriangleMesh strip;
  strip.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 2, 0}, {1, 2, 0}, {0, 3, 0}, {1, 3, 0}};
  strip.sigmas = {3, 3, 1, 1, 1, 1, 3, 3};
  strip.confidences.assign(8, 1);
  strip.triangles = {{0, 1, 3}, {0, 3, 2}, {2, 3, 5}, {2, 5, 4}, {4, 5, 7}, {4, 7, 6}};
  limitSigma(strip, 2);
  EXPECT_TRUE(strip.triangles.empty());
}

} // namespace
