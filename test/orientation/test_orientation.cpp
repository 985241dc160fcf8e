// SPDX-License-Identifier: BSD-3-Clause
#include "orientation/orientation.h"
#include "orientation/orientation_graph.h"
#include "points/gathering.h"
#include "points/normals.h"
#include "points/outliers.h"
#include "points/sampling_density.h"
#include "support/clouds.h"
#include "support/scans.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <tuple>

using namespace pcl::mrf;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

/// The points' normals with random signs, like a perfect estimate without orientation.
std::vector<Vector3f> scrambled(const PointSet& points, unsigned seed = 5)
{
  std::mt19937 random(seed);
  std::vector<Vector3f> normals = points.normals;
  for (Vector3f& normal : normals)
    if (random() % 2 == 0)
      normal = -normal;
  return normals;
}

OrientationResult orient(const PointSet& points, const std::vector<Vector3f>& normals, OrientationVote vote,
                         const OrientationOptions& options = {}, int threads = 1)
{
  Execution execution(threads);
  const auto search = clouds::searchOf(points);
  const SamplingDensity density =
      estimateSamplingDensity(points, measureNeighbors(points, *search, execution), execution);
  return orientNormals(points, normals, *search, density, vote, options, execution);
}

std::vector<Vector3f> estimated(const PointSet& points)
{
  const auto search = clouds::searchOf(points);
  return estimateNormals(points, *search, 0, {}, serial).normals; // only the paper's criteria need a spacing
}

OrientationResult estimateAndOrient(const PointSet& points, OrientationVote vote)
{
  return orient(points, estimated(points), vote);
}

/// The share of the kept points whose normal is on the side of the true one.
double shareRight(const PointSet& points, const OrientationResult& result)
{
  std::int64_t right = 0, kept = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (result.keep[i] && !points.normals[i].isZero()) {
      ++kept;
      right += points.normals[i].dot(result.normals[i]) > 0;
    }
  return static_cast<double>(right) / static_cast<double>(kept);
}

/// Sets the view of each point to the sensor that sees it most from the front.
void assignViews(PointSet& points)
{
  points.views.clear();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto cosine = [&](const Vector3f& sensor) {
      return (sensor - points.positions[i]).normalized().dot(points.normals[i]);
    };
    const auto best = std::max_element(points.sensors.begin(), points.sensors.end(),
                                       [&](const Vector3f& a, const Vector3f& b) { return cosine(a) < cosine(b); });
    points.views.push_back(static_cast<std::int32_t>(best - points.sensors.begin()));
  }
}

/// The points with opposite normals.
PointSet flipped(PointSet points)
{
  for (Vector3f& normal : points.normals)
    normal = -normal;
  return points;
}
} // namespace

TEST(Orientation, ClosedSurfacesPointOutward)
{
  const double spacing = .08;
  const std::vector<shapes::Sdf> closed = {shapes::sphere(1), shapes::torus(1, .4), shapes::box({1, .8, .6}),
                                           shapes::tube({-1, 0, 0}, {1, 0, 0}, .2)};
  for (const shapes::Sdf& sdf : closed) {
    const PointSet points = shapes::sample(sdf, 1.6, spacing);
    // With exact normals, and with estimated ones, which are round at the box's edges.
    for (const auto& normals : {scrambled(points), estimated(points)}) {
      const OrientationResult result = orient(points, normals, OrientationVote::outward);
      EXPECT_EQ(shareRight(points, result), 1);
      EXPECT_EQ(result.components, 1);
      EXPECT_EQ(result.pointsDropped, 0);
      EXPECT_GT(result.agreement, .85); // .88 for the torus by its volume integral, 1 for the convex ones
      EXPECT_LE(result.agreement, 1);
      for (std::size_t i = 0; i < points.size(); ++i)
        EXPECT_EQ(result.normals[i].cwiseAbs(), normals[i].cwiseAbs()) << "only signs may change";
    }
  }
}

TEST(Orientation, NoiseLeavesAlmostAllRight)
{
  PointSet points = shapes::sample(shapes::torus(1, .4), 1.6, .06);
  shapes::addNoise(points, .03); // half a spacing: estimated normals are off by 8 degrees, some by 40
  EXPECT_GT(shareRight(points, estimateAndOrient(points, OrientationVote::outward)), .995);
}

TEST(Orientation, ThinPlateHasTwoSides)
{
  // 2.5 spacings thick: the sides are each other's neighbors, and only the rim, where estimated normals are poor,
  // tells how they belong together.
  for (const double rounding : {0.0, .039}) {
    const PointSet points = shapes::sample(shapes::box({1, 1, .04}, rounding), 1.2, .04);
    const OrientationResult result = estimateAndOrient(points, OrientationVote::outward);
    EXPECT_GT(shareRight(points, result), .995);
    EXPECT_EQ(result.components, 1);
  }
}

TEST(Orientation, ABladeHasTwoSides)
{
  // Two arcs that meet in sharp rims, around which edges lead along a single sheet; the ends are open.
  for (const double thickness : {.2, .3}) {
    const double radius = (1 + thickness * thickness / 4) / thickness, middle = radius - thickness / 2;
    const shapes::Sdf blade = [=](const Vector3d& x) {
      return std::max(std::hypot(x.x(), x.z() - middle), std::hypot(x.x(), x.z() + middle)) - radius;
    };
    const PointSet points =
        shapes::filter(shapes::sample(blade, 1.2, .04), [](const Vector3f& x) { return std::abs(x.y()) < 1.1f; });
    EXPECT_GT(shareRight(points, estimateAndOrient(points, OrientationVote::outward)), .93);
  }
  // Without rims nothing but what faces what joins them: a box without its ends, bent so that both sides bulge up.
  PointSet bent = shapes::filter(shapes::sample(shapes::box({1, 1, .1}), 1.2, .04),
                                 [](const Vector3f& x) { return x.head<2>().cwiseAbs().maxCoeff() < .95f; });
  for (std::size_t i = 0; i < bent.size(); ++i) {
    Vector3f& position = bent.positions[i];
    position.z() -= .2f * position.x() * position.x();
    bent.normals[i] = (bent.normals[i].z() * Vector3f(.4f * position.x(), 0, 1)).normalized();
  }
  EXPECT_GT(shareRight(bent, estimateAndOrient(bent, OrientationVote::outward)), .99);
}

TEST(Orientation, TwoSheetsVoteOnTheirOwn)
{
  // Two sheets at 1.3 and .9 spacings, open at their borders: by their points alone one cannot say that they are
  // two, but the views can. Some percent of the normals are too poor to belong to a piece of smooth surface.
  for (const double thickness : {.04, .028}) {
    PointSet points = shapes::filter(shapes::sample(shapes::box({1, 1, .5 * thickness}), 1.2, .04),
                                     [](const Vector3f& x) { return x.head<2>().cwiseAbs().maxCoeff() < .9f; });
    points.sensors = {{0, 0, 5}, {0, 0, -5}};
    assignViews(points);
    for (const OrientationVote vote : {OrientationVote::sensor, OrientationVote::reference}) {
      const OrientationResult result = estimateAndOrient(points, vote);
      EXPECT_GT(shareRight(points, result), .97);
      EXPECT_GT(result.agreement, .97);
    }
    // Without them the report must not sound sure.
    EXPECT_LT(estimateAndOrient(points, OrientationVote::outward).agreement, .75);
  }
}

/// Objects on a floor before a wall, with a camera's noise: creases and steps in depth lead to normals that face away.
TEST(Orientation, NothingFacesAwayFromWhatSawIt)
{
  const Eigen::Array3f center(0, .1f, 2), radii(.25f, .45f, .2f);
  for (const unsigned seed : {1, 2, 3}) {
    std::mt19937 random(seed);
    std::normal_distribution<float> noise;
    PointSet points;
    for (int n = 0; n < 160 * 120; ++n) {
      const Eigen::Array3f ray(static_cast<float>(n % 160 - 80) / 180, static_cast<float>(n / 160 - 60) / 180, 1);
      float depth = ray.y() > .55f / 3 ? .55f / ray.y() : 3;
      Vector3f normal = ray.y() > .55f / 3 ? Vector3f(0, -1, 0) : Vector3f(0, 0, -1);
      const float a = (ray / radii).square().sum(), b = (ray * center / radii.square()).sum(),
                  determinant = b * b - a * ((center / radii).square().sum() - 1);
      if (determinant > 0 && (b - std::sqrt(determinant)) / a < depth) {
        depth = (b - std::sqrt(determinant)) / a;
        normal = ((depth * ray - center) / radii.square()).matrix().normalized();
      }
      if (random() % 10 == 0)
        continue; // what a camera does not see
      points.positions.emplace_back((depth + .0015f * depth * depth * noise(random)) * ray);
      points.normals.push_back(normal);
    }
    points.sensors = {Vector3f::Zero()};
    const OrientationResult result = estimateAndOrient(points, OrientationVote::sensor);
    EXPECT_GT(shareRight(points, result), .99) << seed;
    EXPECT_GT(result.agreement, .99) << seed;
  }
}

/// Three balls that are closer to each other than their points are: edges of the graph connect them.
TEST(Orientation, ClosedSheetsThatTouchVoteOnTheirOwn)
{
  for (const float spacing : {.08f, .1f, .12f}) {
    const PointSet ball = shapes::sample(shapes::sphere(1), 1.6, spacing);
    const float apart = 2 + .3f * spacing;
    PointSet points;
    for (const Vector3f& center : {Vector3f(0, 0, 0), Vector3f(apart, 0, 0), Vector3f(.5f * apart, .866f * apart, 0)}) {
      for (const Vector3f& position : ball.positions)
        points.positions.emplace_back(center + position);
      points.normals.insert(points.normals.end(), ball.normals.begin(), ball.normals.end());
    }
    EXPECT_GT(shareRight(points, estimateAndOrient(points, OrientationVote::outward)), .99) << spacing;
  }
}

/// Estimated normals where a ball or an egg touches a table connect the two.
TEST(Orientation, WhatLiesOnATableHasItsOwnOutside)
{
  for (const float width : {.8f, 1.f, 1.3f})
    for (const float buried : {0.f, .02f, .4f}) {
      PointSet points = shapes::filter(shapes::sample(shapes::sphere(1), 1.4, .08),
                                       [&](const Vector3f& x) { return x.z() > -1 + buried; });
      for (std::size_t i = 0; i < points.size(); ++i) {
        points.positions[i].head<2>() *= width;
        points.normals[i].head<2>() /= width;
        points.normals[i].normalize();
      }
      const float hidden = width * std::sqrt(1 - (1 - buried) * (1 - buried));
      const PointSet table =
          shapes::filter(clouds::randomSquare(8000, 6), [&](const Vector3f& x) { return x.norm() > hidden; });
      clouds::append(points, table, {0, 0, -1 + buried});
      EXPECT_GT(shareRight(points, estimateAndOrient(points, OrientationVote::outward)), .97) << width << " " << buried;
    }
}

TEST(Orientation, SheetsOfGivenNormalsAreTwoSidesOfOneObject)
{
  // Nearer than the neighbor distance, without a rim, so that only edges along the normals join them.
  PointSet points = clouds::lattice(30, 1);
  clouds::append(points, flipped(points), {0, 0, -2.2f});
  points.sensors = {{0, 0, 100}};
  const std::vector<Vector3f> normals = scrambled(points);
  OrientationOptions options;
  options.neighborDistance = 2.3f; // an automatic one reaches farther at the lattice's border
  const OrientationResult outward = orient(points, normals, OrientationVote::outward, options);
  EXPECT_EQ(outward.components, 1);
  EXPECT_EQ(shareRight(points, outward), 1);
  // A sensor above takes them for two surfaces that it sees.
  const OrientationResult seen = orient(points, normals, OrientationVote::sensor, options);
  EXPECT_EQ(seen.components, 2);
  EXPECT_EQ(seen.agreement, 1);
  for (const Vector3f& normal : seen.normals)
    EXPECT_GT(normal.z(), 0);
}

TEST(Orientation, UnevenSamplingDoesNotTurnTheVolumeInside)
{
  // The inner half of the torus, which contributes negatively to the volume, has 16 times the points of the outer.
  const shapes::Sdf torus = shapes::torus(1, .4);
  const auto isInner = [](const Vector3f& x) { return x.head<2>().norm() < 1; };
  PointSet points = shapes::filter(shapes::sample(torus, 1.6, .03), isInner);
  clouds::append(points,
                 shapes::filter(shapes::sample(torus, 1.6, .12), [&](const Vector3f& x) { return !isInner(x); }));
  double unweighted = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    unweighted += points.positions[i].dot(points.normals[i]);
  ASSERT_LT(unweighted, 0) << "the case is too easy";
  OrientationOptions options;
  options.neighborDistance = .3f; // of the coarse half
  EXPECT_EQ(shareRight(points, orient(points, scrambled(points), OrientationVote::outward, options)), 1);
}

TEST(Orientation, OpenSurfacesSayThatTheirSideIsAGuess)
{
  const PointSet sphere = shapes::sample(shapes::sphere(1), 1.2, .06);
  // The share of a sphere that is missing below z is (1 + z) / 2, its |Σ A n| / Σ A then (1 - z²) / 2 (1 - z).
  for (const float z : {-2.0f, -.95f, -.8f, 0.0f, .5f}) {
    const PointSet above = shapes::filter(sphere, [z](const Vector3f& x) { return x.z() > z; });
    const OrientationResult result = estimateAndOrient(above, OrientationVote::outward);
    EXPECT_EQ(result.sideIsGuessed, z > -.5f) << z;
    EXPECT_EQ(result.openShare, z > -.5f ? 1 : 0) << z;
    EXPECT_EQ(shareRight(above, result), 1) << "outward is the better guess";
    if (z == 0) {
      EXPECT_GT(result.agreement, .75) << "a shallow dome is surer of its outside than the warning's limit";
    }
  }
  PointSet patch = clouds::randomSquare(3000, 1);
  const OrientationResult guess = estimateAndOrient(patch, OrientationVote::outward);
  EXPECT_TRUE(guess.sideIsGuessed);
  EXPECT_NEAR(guess.agreement, .5, .1) << "either sign is right, certainty is not";
  for (const float height : {5.0f, -5.0f}) {
    patch.sensors = {{.3f, .2f, height}};
    const OrientationResult seen = estimateAndOrient(patch, OrientationVote::sensor);
    EXPECT_EQ(seen.agreement, 1);
    EXPECT_FALSE(seen.sideIsGuessed);
    for (const Vector3f& normal : seen.normals)
      EXPECT_GT(normal.z() * height, 0);
  }
  EXPECT_FALSE(estimateAndOrient(patch, OrientationVote::reference).sideIsGuessed);

  // A stray patch beside a closed object is not worth a warning.
  PointSet both = sphere;
  clouds::append(both, clouds::lattice(9, .06f), {5, 0, 0});
  EXPECT_FALSE(estimateAndOrient(both, OrientationVote::outward).sideIsGuessed);
}

TEST(Orientation, ThingsStandOnTheOutside)
{
  // Two roofs beside their plot, on the negative side of an axis that is not z.
  PointSet points = clouds::randomSquare(6000, 2, 1);
  for (const float x : {-.8f, .9f})
    clouds::append(points, clouds::randomSquare(375, .5f, 2), {x, 0, -.7f});
  for (std::vector<Vector3f>* vectors : {&points.positions, &points.normals})
    for (Vector3f& vector : *vectors)
      vector = {vector.x(), vector.z(), -vector.y()};
  const OrientationResult result = estimateAndOrient(points, OrientationVote::outward);
  EXPECT_TRUE(result.sideIsGuessed);
  EXPECT_EQ(shareRight(points, result), 0) << "down";
}

TEST(Orientation, TerrainFacesUpWhateverItsShape)
{
  for (const float height : {-.4f, 0.f, .4f}) {
    PointSet points = clouds::randomSquare(6000, 2, 1);
    for (std::size_t i = 0; i < points.size(); ++i) {
      Vector3f& position = points.positions[i];
      const float bump = height * std::exp(-6 * position.head<2>().squaredNorm());
      position.z() = bump;
      points.normals[i] = Vector3f(12 * bump * position.x(), 12 * bump * position.y(), 1).normalized();
    }
    const OrientationResult result = estimateAndOrient(points, OrientationVote::outward);
    EXPECT_TRUE(result.sideIsGuessed);
    EXPECT_EQ(shareRight(points, result), 1) << height;
  }
}

TEST(Orientation, WhatWasSeenFromAmidItFacesUp)
{
  // A sloping street between two walls, denser near a scanner amid it.
  const Vector3f scanner(0, 0, .3f);
  const Eigen::AngleAxisf slope(.4f, Vector3f::UnitX());
  PointSet points;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 1);
  const auto scan = [&](std::size_t count, const Vector3f& corner, const Vector3f& along, const Vector3f& across) {
    for (std::size_t n = 0; n < count; ++n) {
      const Vector3f at = corner + uniform(random) * along + uniform(random) * across;
      if (uniform(random) < .2f / (at - scanner).squaredNorm())
        clouds::append(points, slope * at, slope * across.cross(along).normalized());
    }
  };
  scan(30000, {-1, -3, 0}, {0, 6, 0}, {2, 0, 0});
  scan(30000, {-1, -3, 0}, {0, 0, 2}, {0, 6, 0});
  scan(30000, {1, -3, 0}, {0, 6, 0}, {0, 0, 2});
  points.spacings = localSpacings(points, measureNeighbors(points, *clouds::searchOf(points), serial), serial);
  const OrientationResult result = estimateAndOrient(points, OrientationVote::outward);
  EXPECT_TRUE(result.sideIsGuessed);
  EXPECT_GT(shareRight(points, result), .99);
}

TEST(Orientation, TheSideWhereTheScannerWasShowsInTheSpacing)
{
  // A corner of three walls seen by a camera on their inner side: the outward vote is wrong about it.
  PointSet points;
  const Vector3f camera(3, 3, 3);
  for (int row = -60; row <= 60; ++row)
    for (int column = -60; column <= 60; ++column) {
      const Vector3f right = Vector3f(1, -1, 0).normalized(), up = Vector3f(-1, -1, 2).normalized();
      const Vector3f ray = Vector3f(-1, -1, -1).normalized() + .006f * static_cast<float>(row) * up +
                           .006f * static_cast<float>(column) * right;
      int wall = 0;
      const float range = (-camera).cwiseQuotient(ray).minCoeff(&wall);
      clouds::append(points, camera + range * ray, Vector3f::Unit(wall));
    }
  const OrientationResult result = estimateAndOrient(points, OrientationVote::outward);
  EXPECT_TRUE(result.sideIsGuessed);
  EXPECT_GT(shareRight(points, result), .99);
}

TEST(Orientation, ShellsInsideOthersFaceTheirCavity)
{
  // A hollow ball with a core in its cavity, and another ball beside it.
  PointSet points;
  for (const float radius : {1.0f, .7f, .3f}) {
    const PointSet shell = shapes::sample(shapes::sphere(radius), 1.2, .06);
    clouds::append(points, radius == .7f ? flipped(shell) : shell);
  }
  clouds::append(points, shapes::sample(shapes::sphere(.5), 1, .06), {2, 0, 0});
  const OrientationResult result = orient(points, scrambled(points), OrientationVote::outward);
  EXPECT_EQ(result.components, 4);
  EXPECT_EQ(shareRight(points, result), 1);
  EXPECT_FALSE(result.sideIsGuessed);
}

TEST(Orientation, FewPointsFollowTheLargerComponentBesideThem)
{
  // Groups of three just beyond the reach of a sphere's points, with its normals.
  PointSet points = shapes::sample(shapes::sphere(1), 1.2, .06);
  const std::size_t large = points.size();
  for (int group = 0; group < 20; ++group) {
    const float angle = .3f * static_cast<float>(group);
    const Vector3f outward(std::cos(angle), std::sin(angle), 0);
    for (const float along : {-.02f, 0.0f, .02f})
      clouds::append(points, 1.2f * outward + along * Vector3f::UnitZ(), outward);
  }
  OrientationOptions options;
  options.neighborDistance = .15f;
  const OrientationResult result = orient(points, scrambled(points), OrientationVote::outward, options);
  EXPECT_EQ(result.components, 21);
  EXPECT_EQ(result.pointsDropped, 0);
  EXPECT_EQ(shareRight(points, result), 1) << "of " << points.size() - large;
}

TEST(Orientation, NeighborsAreThoseOfTheLocalSpacing)
{
  // Rows of a range image whose spacing grows from .01 to 1: one distance for all cuts the sparse part into pieces.
  PointSet points;
  for (float x = .1f; x < 10; x *= 1.1f)
    for (float y = -5; y < 5; y += .1f * x)
      clouds::append(points, {x, y, 0}, Vector3f::UnitZ());
  points.sensors = {{0, 0, 1}};
  OrientationOptions options;
  EXPECT_EQ(orient(points, scrambled(points), OrientationVote::sensor, options).components, 1);
  EXPECT_EQ(orient(points, points.normals, OrientationVote::none, options).components, 1);
  options.localDistance = false;
  EXPECT_GT(orient(points, scrambled(points), OrientationVote::sensor, options).components, 50);
}

TEST(Orientation, RingsOfALidarFaceIt)
{
  const PointSet points = clouds::lidar();
  const OrientationResult result = estimateAndOrient(points, OrientationVote::sensor);
  EXPECT_GT(shareRight(points, result), .98);
  EXPECT_GT(result.agreement, .98);
  EXPECT_EQ(result.pointsDropped, 0);
  EXPECT_TRUE(estimateAndOrient(points, OrientationVote::outward).sideIsGuessed);
}

TEST(Orientation, SensorsFlipAComponentThatLooksAway)
{
  PointSet points = shapes::sample(shapes::sphere(1), 1.2, .08);
  points.sensors = {{0, 0, 4}, {0, 0, -4}};
  const OrientationResult turned = orient(points, flipped(points).normals, OrientationVote::sensor);
  EXPECT_EQ(shareRight(points, turned), 1);
  EXPECT_EQ(turned.componentsFlipped, 1);
  EXPECT_EQ(turned.pointsFlipped, static_cast<std::int64_t>(points.size()));
  EXPECT_EQ(orient(points, points.normals, OrientationVote::sensor).pointsFlipped, 0);

  points.sensors = {{0, 0, 0}}; // from inside the sphere the visible side is the inner one
  EXPECT_EQ(shareRight(points, orient(points, points.normals, OrientationVote::sensor)), 0);
}

TEST(Orientation, ViewsSayWhichSensorSawAPoint)
{
  // A room: each sensor is nearer to the wall behind it, which it did not see, than to the wall it saw. The walls are
  // seen from outside, through each other.
  PointSet points;
  clouds::append(points, clouds::lattice(20, .1f), {0, 0, 1});
  clouds::append(points, flipped(clouds::lattice(20, .1f)), {0, 0, -1});
  points.sensors = {{0, 0, .5f}, {0, 0, -.5f}};
  const std::size_t half = points.size() / 2;
  const auto isInward = [&](const OrientationResult& result) { return shareRight(points, result) == 0; };
  EXPECT_TRUE(isInward(orient(points, scrambled(points), OrientationVote::sensor)));
  points.sensors = {{0, 0, -1.5f}, {0, 0, 1.5f}};
  EXPECT_EQ(shareRight(points, orient(points, scrambled(points), OrientationVote::sensor)), 1) << "nearest";
  points.views.assign(points.size(), 0);
  std::fill(points.views.begin() + static_cast<std::ptrdiff_t>(half), points.views.end(), 1);
  EXPECT_TRUE(isInward(orient(points, scrambled(points), OrientationVote::sensor)));
  points.views.assign(points.size(), -1);
  EXPECT_EQ(shareRight(points, orient(points, scrambled(points), OrientationVote::sensor)), 1) << "views unknown";
}

TEST(Orientation, ReferenceNormalsVote)
{
  PointSet points = shapes::sample(shapes::torus(1, .4), 1.6, .08);
  const PointSet truth = points;
  std::mt19937 random(3);
  for (Vector3f& normal : points.normals) {
    if (random() % 4 == 0) // a quarter of them lies, an eighth says nothing
      normal = -normal;
    if (random() % 8 == 0)
      normal.setZero();
  }
  const OrientationResult result = estimateAndOrient(points, OrientationVote::reference);
  EXPECT_EQ(shareRight(truth, result), 1);
  EXPECT_NEAR(result.agreement, .75, .03); // 2,700 votes: three standard deviations
  EXPECT_EQ(shareRight(truth, estimateAndOrient(flipped(points), OrientationVote::reference)), 0);
}

TEST(Orientation, WithoutAVoteSignsStay)
{
  PointSet points = shapes::sample(shapes::sphere(1), 1.2, .08);
  clouds::append(points, {5, 5, 5}, Vector3f::UnitX());
  const std::vector<Vector3f> normals = scrambled(points);
  const OrientationResult result = orient(points, normals, OrientationVote::none);
  EXPECT_EQ(result.normals, normals);
  EXPECT_EQ(result.pointsFlipped, 0);
  EXPECT_EQ(result.agreement, 1);
  EXPECT_EQ(result.components, 2);
  EXPECT_EQ(result.componentsDropped, 0) << "no point is dropped for what the others are";
  OrientationOptions options;
  options.minComponentShare = .01f;
  const OrientationResult most = orient(points, normals, OrientationVote::none, options);
  EXPECT_EQ(most.componentsDropped, 1);
  EXPECT_FALSE(most.keep.back());
  points.gathered = 101 * points.size(); // of which outliers were dropped since
  EXPECT_EQ(orient(points, normals, OrientationVote::none, options).componentsDropped, 2);
}

TEST(Orientation, ComponentsWithoutAVoteAreThoseOfAllEdges)
{
  // Sheets, scan lines and single points with normals that agree, nearly agree or not at all.
  PointSet points = clouds::randomSquare(1200, 1);
  clouds::append(points, clouds::randomSquare(400, .6f, 2), {0, 0, .2f});
  for (int i = 0; i < 300; ++i)
    clouds::append(points, {.001f * static_cast<float>(i), 2 + .3f * static_cast<float>(i % 3), 0}, Vector3f::UnitZ());
  std::mt19937 random(3);
  std::normal_distribution<float> tilt(0, .25f);
  std::vector<Vector3f> normals = points.normals;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const float x = tilt(random), y = tilt(random);
    normals[i] = i % 97 == 0 ? Vector3f(Vector3f::Zero()) : Vector3f(Vector3f(x, y, 1).normalized());
  }

  for (const bool joinAcrossCreases : {true, false})
    for (const float distance : {.03f, .06f, .15f}) {
      OrientationOptions options;
      options.neighborDistance = distance;
      options.joinAcrossCreases = joinAcrossCreases;
      options.minComponentShare = .05f;
      const float minCosine = std::cos(options.maxAngle * static_cast<float>(EIGEN_PI) / 180);
      // Every point takes the label of its neighbors until nothing changes.
      const std::size_t count = points.size();
      const auto labelsBy = [&](const auto& isEdge) {
        std::vector<std::size_t> labels(count);
        std::iota(labels.begin(), labels.end(), std::size_t{0});
        for (bool changed = true; changed;) {
          changed = false;
          for (std::size_t i = 0; i < count; ++i)
            for (std::size_t j = 0; j < i; ++j)
              if (labels[i] != labels[j] && isEdge(i, j)) {
                labels[i] = labels[j] = std::min(labels[i], labels[j]);
                changed = true;
              }
        }
        return labels;
      };
      const auto isNear = [&](std::size_t i, std::size_t j) {
        return (points.positions[i] - points.positions[j]).norm() <= distance && !normals[i].isZero() &&
               !normals[j].isZero();
      };
      const auto isParallel = [&](std::size_t i, std::size_t j) {
        return std::abs(normals[i].dot(normals[j])) >= minCosine;
      };
      const auto labels = labelsBy([&](std::size_t i, std::size_t j) {
        const Vector3f e = (points.positions[i] - points.positions[j]).normalized();
        const bool acrossSheets = std::abs(e.dot(normals[i])) > .9f && std::abs(e.dot(normals[j])) > .9f;
        return isNear(i, j) && !acrossSheets && (joinAcrossCreases || isParallel(i, j));
      });
      const auto smooth = labelsBy([&](std::size_t i, std::size_t j) { return isNear(i, j) && isParallel(i, j); });

      std::vector<std::size_t> sizes(count, 0);
      for (const std::size_t label : labels)
        ++sizes[label];
      std::int64_t components = 0, atCreases = 0;
      std::vector<std::uint8_t> keep(count, 0);
      for (std::size_t i = 0; i < count; ++i) {
        components += labels[i] == i && !normals[i].isZero();
        atCreases += smooth[i] == i && !normals[i].isZero();
        keep[i] = !normals[i].isZero() && static_cast<double>(sizes[labels[i]]) >= .05f * static_cast<double>(count);
      }
      for (const int threads : {1, 3}) {
        const OrientationResult result = orient(points, normals, OrientationVote::none, options, threads);
        EXPECT_EQ(result.components, components) << distance;
        EXPECT_EQ(result.componentsAtCreases, atCreases) << distance;
        EXPECT_EQ(result.keep, keep) << distance;
      }
    }
}

TEST(Orientation, CreasesSeparateOnlyOnRequest)
{
  const Vector3f half(1, .8f, .6f);
  PointSet points = shapes::sample(shapes::box(half.cast<double>()), 1.2, .06);
  points = shapes::filter(points, [&](const Vector3f& x) { // points right on an edge belong to no face
    return ((x.cwiseAbs() - half).array() > -1e-5f).count() == 1;
  });
  const std::vector<Vector3f> normals = scrambled(points);
  const OrientationResult joined = orient(points, normals, OrientationVote::outward);
  EXPECT_EQ(joined.components, 1);
  EXPECT_EQ(joined.componentsAtCreases, 6); // exact normals: the faces
  EXPECT_EQ(shareRight(points, joined), 1);

  OrientationOptions options;
  options.joinAcrossCreases = false;
  const OrientationResult cut = orient(points, normals, OrientationVote::outward, options);
  EXPECT_EQ(cut.components, 6);
  EXPECT_EQ(cut.componentsAtCreases, 6);
  options.minComponentShare = .14f; // the paper's search loses the smallest pair of faces: .8·.6 of 3.76 each
  const OrientationResult dropped = orient(points, normals, OrientationVote::outward, options);
  EXPECT_EQ(dropped.componentsDropped, 2);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_EQ(dropped.keep[i] == 0, std::abs(points.normals[i].x()) > .9f) << i;

  options.maxAngle = 90;
  EXPECT_EQ(orient(points, normals, OrientationVote::outward, options).components, 1);
}

TEST(Orientation, ScanLinesFartherApartThanTheirPointsAreOneComponent)
{
  // The 12 nearest neighbors all lie on the point's own line, 15 times as dense as the lines are.
  PointSet points;
  for (int line = 0; line < 30; ++line)
    for (int n = 0; n < 450; ++n)
      clouds::append(points, {static_cast<float>(n) / 15 - 15, static_cast<float>(line) - 15, 0}, Vector3f::UnitZ());
  points.sensors = {{0, 0, 100}};
  OrientationOptions options;
  options.neighborDistance = 1.5f;
  const OrientationResult result = orient(points, scrambled(points), OrientationVote::sensor, options);
  EXPECT_EQ(result.components, 1);
  EXPECT_EQ(shareRight(points, result), 1);
  options.neighborDistance = .9f;
  EXPECT_EQ(orient(points, scrambled(points), OrientationVote::sensor, options).components, 30);
}

TEST(Orientation, DegenerateClouds)
{
  // Points on a line have no normals of their own; given ones must do. Duplicates are edges of length 0.
  PointSet points;
  for (int n = 0; n < 60; ++n)
    for (int copy = 0; copy < n % 17; ++copy)
      clouds::append(points, {static_cast<float>(n), 0, 0}, Vector3f::UnitZ());
  points.sensors = {{0, 0, 10}};
  for (const OrientationVote vote :
       {OrientationVote::none, OrientationVote::reference, OrientationVote::sensor, OrientationVote::outward}) {
    const OrientationResult result = orient(points, points.normals, vote);
    EXPECT_EQ(result.normals.size(), points.size());
    const double share = shareRight(points, result);
    EXPECT_TRUE(share == 1 || (vote == OrientationVote::outward && share == 0)) << share;
    EXPECT_EQ(estimateAndOrient(points, vote).pointsDropped, static_cast<std::int64_t>(points.size()));
  }
  const OrientationResult nothing =
      orientNormals({}, {}, *makeKdTree(), SamplingDensity(), OrientationVote::outward, {}, serial);
  EXPECT_EQ(nothing.components, 0);
  EXPECT_TRUE(nothing.normals.empty());
}

TEST(Orientation, DoesNotDependOnThreadsOrderOrScale)
{
  PointSet points = shapes::sample(shapes::torus(1, .4), 1.6, .06);
  shapes::addNoise(points, .02);
  const std::vector<Vector3f> normals = estimated(points);
  sameOnAnyThreads([&](int threads) {
    const OrientationResult r = orient(points, normals, OrientationVote::outward, {}, threads);
    return std::make_tuple(r.normals, r.keep, r.agreement, r.pointsFlipped, r.componentsAtCreases);
  });
  const OrientationResult expected = orient(points, normals, OrientationVote::outward);

  const std::vector<std::uint32_t> order = clouds::shuffledOrder(points.size());
  std::vector<Vector3f> shuffledNormals;
  for (const std::uint32_t i : order)
    shuffledNormals.push_back(normals[i]);
  const OrientationResult shuffled =
      orient(clouds::reordered(points, order), shuffledNormals, OrientationVote::outward);
  EXPECT_EQ(shuffled.componentsAtCreases, expected.componentsAtCreases);
  for (std::size_t n = 0; n < order.size(); ++n)
    EXPECT_EQ(shuffled.normals[n], expected.normals[order[n]]);

  for (const float factor : {1e-3f, 1e3f}) {
    const OrientationResult scaled = orient(clouds::scaled(points, factor), normals, OrientationVote::outward);
    // Rounding moves few neighbors across the distance and few edges in their order.
    std::size_t different = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
      different += scaled.normals[i] != expected.normals[i];
    EXPECT_LE(different, points.size() / 1000);
    EXPECT_NEAR(scaled.agreement, expected.agreement, 1e-3);
  }
}

TEST(Orientation, MissingInputIsRefused)
{
  PointSet points = clouds::lattice(10, 1);
  const std::vector<Vector3f> normals = points.normals;
  EXPECT_NE(clouds::messageOf<InvalidInput>([&] { orient(points, normals, OrientationVote::sensor); }), "");
  EXPECT_NE(clouds::messageOf<InvalidInput>([&] { orient(points, {Vector3f::UnitZ()}, OrientationVote::none); }), "");
  points.normals.clear();
  EXPECT_NE(clouds::messageOf<InvalidInput>([&] { orient(points, normals, OrientationVote::reference); }), "");
}

TEST(OrientationOfScans, WithAndWithoutSensors)
{
  for (const std::string& name : scans::available({"model", "model_noise", "nefertiti", "bunny_raw", "igea_noise"})) {
    PointSet points = scans::load(name).points;
    // A part of the raw scans, for the time it takes; they come shuffled.
    std::vector<std::uint8_t> keep(points.size(), 1);
    std::fill(keep.begin() + std::min<std::ptrdiff_t>(30000, static_cast<std::ptrdiff_t>(keep.size())), keep.end(), 0);
    points = select(points, keep);
    const auto search = clouds::searchOf(points);
    const NeighborDistances distances = measureNeighbors(points, *search, serial);
    points = select(points, findOutliers(points, distances, *search, {}, serial).keep);

    const std::vector<Vector3f> normals = estimated(points);
    EXPECT_GE(shareRight(points, orient(points, normals, OrientationVote::outward)), .99) << name;
    const OrientationResult seen = orient(points, normals, OrientationVote::sensor);
    EXPECT_GE(shareRight(points, seen), .99) << name;
    EXPECT_GE(seen.agreement, .98) << name;
    EXPECT_LT(static_cast<double>(seen.pointsDropped), .005 * static_cast<double>(points.size())) << name;
  }
}

TEST(OrientationOfScans, OpenOnesFaceTheirSensor)
{
  for (const std::string& name : scans::available({"table", "real/kinect_table", "real/kinect_office"})) {
    const PointSet points = scans::load(name).points;
    const OrientationResult result = estimateAndOrient(points, OrientationVote::sensor);
    // At the edges of what the sensor sees, two estimates that both face it differ by more than 90°: .98 % in the
    // office.
    EXPECT_GE(shareRight(points, result), .98) << name;
    std::size_t away = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
      away += result.normals[i].dot(points.sensors[0] - points.positions[i]) < 0;
    EXPECT_LT(static_cast<double>(away), .002 * static_cast<double>(points.size())) << name;
    EXPECT_EQ(result.pointsDropped, 0) << name;
  }
}

TEST(OrientationOfScans, WarnOfAGuessIfOpen)
{
  for (const std::string& name : scans::available({"table", "street", "model_front", "real/kinect_table",
                                                   "real/kinect_office", "real/samp11", "real/dragon_one"}))
    EXPECT_TRUE(estimateAndOrient(scans::load(name).points, OrientationVote::outward).sideIsGuessed) << name;
  for (const std::string& name :
       scans::available({"model", "model_noise", "igea_clean", "igea_noise", "nefertiti", "bunny", "bunny_raw"}))
    EXPECT_FALSE(estimateAndOrient(scans::load(name).points, OrientationVote::outward).sideIsGuessed) << name;
}

TEST(OrientationGraph, NumbersTheEdgesOfMoreThan357MillionPoints)
{
  // Twelve places per point: from 358 million points on their numbers have more than 32 bits.
  constexpr std::size_t far = 12 * std::size_t{400000000};
  static_assert(far > 0xffffffff, "the case that used to overflow");
  EXPECT_NO_THROW(OrientationGraph::requireRoom(400000000, 1000));
  for (const float quality : {0.f, .5f, std::nextafter(1.f, 0.f), 1.f})
    for (const std::size_t place : {std::size_t{0}, far, (std::size_t{1} << edge_key::placeBits) - 1})
      EXPECT_EQ(edge_key::placeOf(edge_key::of(quality, place)), place) << quality;
  EXPECT_LT(edge_key::of(1, far), edge_key::of(.999f, 0)) << "the best edges first";
  EXPECT_LT(edge_key::of(.5f, far), edge_key::of(.5f, far + 1));
}

TEST(OrientationGraph, RefusesMorePointsThanItCanNumber)
{
  for (const auto& [points, edges] :
       {std::pair<std::size_t, std::size_t>(1500000000, 0),
        std::pair<std::size_t, std::size_t>(std::numeric_limits<std::size_t>::max(), 0),
        std::pair<std::size_t, std::size_t>(1400000000, 400000000),
        std::pair<std::size_t, std::size_t>(0, std::numeric_limits<std::size_t>::max())}) {
    const std::string message =
        clouds::messageOf<ResourceLimit>([&, p = points, e = edges] { OrientationGraph::requireRoom(p, e); });
    EXPECT_NE(message.find(std::to_string(points) + " points"), std::string::npos) << message;
  }
}

TEST(PointSet, RefusesMorePointsThanIndicesCount)
{
  EXPECT_NO_THROW(requireCountable(2147483647));
  EXPECT_NE(clouds::messageOf<ResourceLimit>([] { requireCountable(3000000000); }).find("3000000000 points"),
            std::string::npos);
}
