// SPDX-License-Identifier: BSD-3-Clause
// Compares the evaluator's figures with brute force, CGAL and known answers.
#include "evaluate/evaluation.h"
#include "evaluate/local_spacing.h"
#include "evaluate/sigma_evaluation.h"
#include "evaluate/surface_distance.h"
#include "support/random.h"

#include <pcl/surface/mrf/exceptions.h>

#include <shapes/signed_distance.h>

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <limits>
#include <numeric>
#include <random>

using namespace mrf_apps;
using clouds::Random;
using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

namespace {

/// Exact up to the last rounding.
double toTriangle(const Vector3d& point, const SurfaceMesh& mesh, const std::array<std::int32_t, 3>& triangle)
{
  using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
  const auto exact = [](const Vector3d& x) { return Kernel::Point_3(x.x(), x.y(), x.z()); };
  const auto corner = [&](std::size_t n) { return exact(mesh.vertices[triangle[n]]); };
  return std::sqrt(
      CGAL::to_double(CGAL::squared_distance(exact(point), Kernel::Triangle_3(corner(0), corner(1), corner(2)))));
}

double bruteForce(const Vector3d& point, const SurfaceMesh& mesh)
{
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!areaVector(mesh, t).isZero(0))
      least = std::min(least, toTriangle(point, mesh, mesh.triangles[t]));
  return least;
}

/// Separate triangles of all shapes and sizes, needles and triangles without area among them.
SurfaceMesh soup(int count, unsigned seed)
{
  Random random(seed);
  SurfaceMesh mesh;
  for (int t = 0; t < count; ++t) {
    const Vector3d a = random.inCube();
    const double size = std::pow(10., -static_cast<double>(random.index(4)));
    const Vector3d b = a + size * random.inCube();
    const Vector3d third = size * random.inCube();
    const Vector3d c = t % 10 == 0   ? Vector3d(b + 1e-7 * third)
                       : t % 10 == 1 ? Vector3d(.5 * (a + b) + 1e-7 * third)
                       : t % 10 == 2 ? b
                                     : Vector3d(a + third);
    mesh.vertices.insert(mesh.vertices.end(), {a, b, c});
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  return mesh;
}

/// A polyhedron of longitudes and latitudes with all vertices on the sphere, oriented outward.
SurfaceMesh sphere(int levels, double radius)
{
  const int rows = 2 << levels, columns = 2 * rows;
  SurfaceMesh mesh;
  mesh.vertices = {radius * Vector3d::UnitZ(), -radius * Vector3d::UnitZ()};
  for (int row = 1; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const auto polar = shapes::sinCos(.5 * row / rows), around = shapes::sinCos(1. * column / columns);
      mesh.vertices.emplace_back(radius * polar.sine * around.cosine, radius * polar.sine * around.sine,
                                 radius * polar.cosine);
    }
  const auto at = [=](int row, int column) {
    return row == 0 ? 0 : row == rows ? 1 : 2 + (row - 1) * columns + column % columns;
  };
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      if (row > 0)
        mesh.triangles.push_back({at(row, column), at(row + 1, column), at(row, column + 1)});
      if (row + 1 < rows)
        mesh.triangles.push_back({at(row, column + 1), at(row + 1, column), at(row + 1, column + 1)});
    }
  return mesh;
}

/// nx × ny points `side` apart in a plane of constant z, from the corner on.
Points lattice(int nx, int ny, double side, const Vector3d& corner = Vector3d::Zero())
{
  Points points;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      points.emplace_back(corner + Vector3d(i * side, j * side, 0));
  return points;
}

/// A rectangle [0, nx·side] × [0, ny·side] at the height z, facing up; triangles row by row.
SurfaceMesh rectangle(int nx, int ny, double side, double z)
{
  SurfaceMesh mesh;
  mesh.vertices = lattice(nx + 1, ny + 1, side, {0, 0, z});
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const int v = i + j * (nx + 1);
      mesh.triangles.push_back({v, v + 1, v + nx + 2});
      mesh.triangles.push_back({v, v + nx + 2, v + nx + 1});
    }
  return mesh;
}

SurfaceMesh tetrahedron(const Vector3d& origin = Vector3d::Zero())
{
  SurfaceMesh mesh;
  mesh.vertices = {origin, origin + Vector3d::UnitX(), origin + Vector3d::UnitY(), origin + Vector3d::UnitZ()};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  return mesh;
}

SurfaceMesh moved(SurfaceMesh mesh, const Vector3d& shift)
{
  for (Vector3d& vertex : mesh.vertices)
    vertex += shift;
  mesh.doublePrecision = true;
  return mesh;
}

Evaluation measured(const SurfaceMesh& mesh, const EvaluationInput& input = {}, EvaluationOptions options = {})
{
  pcl::mrf::Execution execution(2);
  options.samples = std::min<std::int64_t>(options.samples, 20000);
  return evaluate(mesh, input, options, execution);
}

EvaluationInput against(const SurfaceMesh& reference)
{
  EvaluationInput input;
  input.reference = reference;
  return input;
}

void expectAll(const Statistics& statistics, double value, double tolerance)
{
  for (const double figure :
       {statistics.rms, statistics.mean, statistics.median, statistics.percentile95, statistics.max})
    EXPECT_NEAR(figure, value, tolerance);
}

/// Bound of the rounding error of a few operations with coordinates of the order of 1.
constexpr double rounding = 1e-13;
/// The same for sums over some ten thousand samples.
constexpr double sumRounding = 1e-11;

/// Local spacing inside a lattice of side 1: the 8th neighbor is across the diagonal of a square.
const double latticeSpacing = .313 * std::sqrt(2.);

} // namespace

TEST(SurfaceDistance, agreesWithBruteForce)
{
  const SurfaceMesh mesh = soup(300, 1);
  const SurfaceDistance distance(mesh);
  Random random(2);
  Points points;
  for (int i = 0; i < 600; ++i) {
    const Vector3d& corner = mesh.vertices[random.index(mesh.vertices.size())];
    points.emplace_back(corner + std::pow(10., static_cast<double>(i % 6) - 4) * random.inCube());
  }
  pcl::mrf::Execution execution(2);
  const std::vector<ClosestPlace> places = distance.closest(points, execution);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(places[i].distance, bruteForce(points[i], mesh), rounding * (1 + points[i].norm())) << "point " << i;
    // The triangle that is named is one at that distance.
    EXPECT_NEAR(places[i].distance, toTriangle(points[i], mesh, mesh.triangles[places[i].triangle]),
                rounding * (1 + points[i].norm()));
  }
}

TEST(SurfaceDistance, findsTheSameOfEquallyNearTriangles)
{
  // At each vertex six of them meet.
  const SurfaceMesh mesh = rectangle(300, 300, .01, 0);
  pcl::mrf::Execution execution(2);
  const auto trianglesAtVertices = [&] {
    std::vector<std::int32_t> triangles;
    for (const ClosestPlace& place : SurfaceDistance(mesh).closest(mesh.vertices, execution))
      triangles.push_back(place.triangle);
    return triangles;
  };
  const std::vector<std::int32_t> first = trianglesAtVertices();
  for (int run = 0; run < 5; ++run)
    EXPECT_EQ(trianglesAtVertices(), first);
}

TEST(SurfaceSamples, areUniform)
{
  SurfaceMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {10, 0, 0}, {13, 0, 0}, {10, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 1}, {3, 4, 5}};
  const std::int64_t count = 40000;
  const SurfaceSamples samples = sampleSurface(mesh, count, 7);
  ASSERT_EQ(samples.positions.size(), static_cast<std::size_t>(count));
  EXPECT_EQ(std::count(samples.triangles.begin(), samples.triangles.end(), 0), count / 4) << "areas are 1 : 3";
  EXPECT_EQ(std::count(samples.triangles.begin(), samples.triangles.end(), 1), 0);
  double x = 0, xx = 0, xy = 0;
  for (std::int64_t i = 0; i < count / 4; ++i) {
    const Vector3d& p = samples.positions[i];
    EXPECT_GE(p.minCoeff(), 0);
    EXPECT_LE(p.x() + p.y(), 1 + rounding);
    x += p.x() / 10000;
    xx += p.x() * p.x() / 10000;
    xy += p.x() * p.y() / 10000;
  }
  // Moments of the uniform density on the unit right triangle; deviations of 10,000 random draws are below .0024.
  EXPECT_NEAR(x, 1. / 3, .01);
  EXPECT_NEAR(xx, 1. / 6, .01);
  EXPECT_NEAR(xy, 1. / 12, .01);
  EXPECT_EQ(sampleSurface(mesh, count, 7).positions, samples.positions);
  EXPECT_NE(sampleSurface(mesh, count, 8).positions, samples.positions);
}

TEST(Summary, ofKnownValues)
{
  const Statistics statistics = summarize({4, 1, 3, 2, 0});
  EXPECT_EQ(statistics.count, 5);
  EXPECT_DOUBLE_EQ(statistics.mean, 2);
  EXPECT_DOUBLE_EQ(statistics.median, 2);
  EXPECT_DOUBLE_EQ(statistics.rms, std::sqrt(6.));
  EXPECT_DOUBLE_EQ(statistics.percentile95, 3.8);
  EXPECT_DOUBLE_EQ(statistics.max, 4);
  EXPECT_EQ(summarize({}).count, 0);
}

TEST(Evaluate, scaledSphereIsOnePerCentOff)
{
  const double radius = 40;
  const SurfaceMesh reference = sphere(5, radius), mesh = sphere(5, 1.01 * radius);
  EvaluationInput input = against(reference);
  EvaluationOptions options;
  options.diagonal = radius;

  // The polyhedron is convex and inscribed: the closest place of it to a point straight above a vertex is that vertex,
  // so that the tessellation does not matter.
  input.cloud = mesh.vertices;
  const Evaluation onReference = measured(reference, input, options);
  expectAll(*onReference.cloud, .01 * radius, sumRounding);
  const nlohmann::ordered_json json = toJson(onReference);
  EXPECT_NEAR(json["distances"]["cloudPercent"]["rms"].get<double>(), 1, 1e-10);

  // Everywhere else the gap is a hundredth of the distance of a facet's plane from the center: at least `lowest`.
  double lowest = 1;
  for (std::size_t t = 0; t < reference.triangles.size(); ++t)
    lowest = std::min(lowest, areaVector(reference, t).normalized().dot(reference.vertices[reference.triangles[t][0]]) /
                                  radius);
  ASSERT_GT(lowest, .998);
  const Evaluation scaled = measured(mesh, input, options);
  for (const Statistics& way : {scaled.reference->meshToReference, scaled.reference->referenceToMesh})
    for (const double figure : {way.rms, way.mean, way.median, way.percentile95, way.max}) {
      EXPECT_GE(figure, .01 * lowest * radius - sumRounding);
      EXPECT_LE(figure, .01 * radius + sumRounding);
    }
  EXPECT_NEAR(scaled.reference->hausdorff, .01 * radius, rounding * radius);
  EXPECT_LT(scaled.reference->normalDeviation.median, 1e-6) << "the closest facet is the same one, but near edges";
  EXPECT_EQ(scaled.reference->flippedShare, 0);
  EXPECT_EQ(scaled.mesh.eulerCharacteristic, 2);
}

TEST(Evaluate, planeAtAnOffset)
{
  const SurfaceMesh reference = rectangle(20, 10, .1, 0);
  SurfaceMesh mesh = rectangle(20, 10, .1, .3);
  EvaluationOptions options;
  options.farLimit = .31;
  const Evaluation above = measured(mesh, against(reference), options);
  EXPECT_EQ(above.diagonalSource, "reference");
  EXPECT_NEAR(above.options.diagonal, std::sqrt(5.), rounding);
  expectAll(above.reference->meshToReference, .3, sumRounding);
  expectAll(above.reference->referenceToMesh, .3, sumRounding);
  EXPECT_NEAR(above.reference->hausdorff, .3, rounding);
  EXPECT_EQ(above.reference->inventedShare, 0);
  EXPECT_EQ(above.reference->missingShare, 0);
  // Grid coordinates are multiples of .1, rounded: normals are exact to 1e-14.
  expectAll(above.reference->normalDeviation, 0, 1e-10);

  for (auto& triangle : mesh.triangles)
    std::swap(triangle[0], triangle[1]);
  const Evaluation turned = measured(mesh, against(reference), options);
  expectAll(turned.reference->normalDeviation, 180, 1e-10);
  EXPECT_EQ(turned.reference->flippedShare, 1);

  options.farLimit = .29;
  const Evaluation beyond = measured(mesh, against(reference), options);
  EXPECT_EQ(beyond.reference->inventedShare, 1);
  EXPECT_EQ(beyond.reference->missingShare, 1);
  EXPECT_EQ(beyond.reference->normalDeviation.count, 0);
}

TEST(Evaluate, tiltedPlane)
{
  const SurfaceMesh reference = rectangle(40, 10, .1, 0);
  SurfaceMesh mesh = reference;
  const Eigen::AngleAxisd tilt(M_PI / 180, Vector3d::UnitY());
  for (Vector3d& vertex : mesh.vertices)
    vertex = tilt * vertex;
  EvaluationOptions options;
  options.farLimit = 1;
  const Evaluation evaluation = measured(mesh, against(reference), options);
  expectAll(evaluation.reference->normalDeviation, 1, 1e-9);
  // The height below the reference grows evenly to 4 sin 1°: its mean square is a third of the largest one's. The
  // strata know such a share to 1/20,000.
  EXPECT_NEAR(evaluation.reference->meshToReference.rms, 4 * std::sin(M_PI / 180) / std::sqrt(3.), 1e-4);
  EXPECT_NEAR(evaluation.reference->hausdorff, 4 * std::sin(M_PI / 180), rounding);
}

TEST(Evaluate, missingPartOfASurface)
{
  const SurfaceMesh reference = rectangle(16, 4, .25, 0), mesh = rectangle(12, 4, .25, 0);
  EvaluationOptions options;
  options.farLimit = .25;
  const Evaluation evaluation = measured(mesh, against(reference), options);
  // The mesh ends at x = 3, the reference at 4; of each of the four rows at most two samples straddle the limit.
  EXPECT_NEAR(evaluation.reference->missingShare, .75 / 4, 8 / 20000. + rounding);
  EXPECT_EQ(evaluation.reference->inventedShare, 0);
  expectAll(evaluation.reference->meshToReference, 0, rounding);
  EXPECT_NEAR(evaluation.reference->hausdorff, 1, rounding) << "vertices count";
}

TEST(Evaluate, translation)
{
  const SurfaceMesh reference = sphere(3, 1), mesh = sphere(3, 1.02);
  const Vector3d shift(1000, -2000, 500);
  EvaluationInput input = against(reference), there = against(moved(reference, shift));
  input.cloud = reference.vertices;
  there.cloud = there.reference->vertices;
  const Evaluation here = measured(mesh, input), away = measured(moved(mesh, shift), there);
  // Coordinates are rounded to 2^-42 by the shift.
  const double tolerance = 4 * 0x1p-42;
  EXPECT_NEAR(here.cloud->rms, away.cloud->rms, tolerance);
  EXPECT_NEAR(here.reference->meshToReference.max, away.reference->meshToReference.max, tolerance);
  EXPECT_NEAR(here.reference->hausdorff, away.reference->hausdorff, tolerance);
  EXPECT_EQ(here.selfIntersectingTriangles, away.selfIntersectingTriangles);
  // Checked in single precision, relative to the center.
  EXPECT_NEAR(here.mesh.area, away.mesh.area, 1e-5);
  EXPECT_EQ(away.mesh.degenerateTriangles, 0);
}

TEST(Evaluate, pointsAndDiagonals)
{
  const SurfaceMesh mesh = rectangle(4, 4, .25, 0);
  EvaluationInput input;
  EXPECT_EQ(measured(mesh).diagonalSource, "mesh");
  EXPECT_FALSE(measured(mesh).cloud.has_value());
  input.heldOut = {{.5, .5, .2}, {.5, .5, -.4}, {std::nan(""), 0, 0}};
  input.cloud = {{0, 0, 3}, {4, 0, 0}};
  const Evaluation evaluation = measured(mesh, input);
  EXPECT_EQ(evaluation.diagonalSource, "input cloud");
  EXPECT_DOUBLE_EQ(evaluation.options.diagonal, 5);
  EXPECT_DOUBLE_EQ(evaluation.options.farLimit, .05);
  EXPECT_NEAR(evaluation.cloud->rms, 3, rounding);
  EXPECT_EQ(evaluation.heldOut->count, 2);
  EXPECT_EQ(evaluation.pointsNotFinite, 1);
  EXPECT_NEAR(evaluation.heldOut->rms, std::sqrt((.04 + .16) / 2), rounding);
  EXPECT_FALSE(evaluation.clean.has_value());
  EXPECT_FALSE(evaluation.reference.has_value());
  const nlohmann::ordered_json json = toJson(evaluation);
  EXPECT_FALSE(json.contains("reference"));
  EXPECT_FALSE(json["distances"].contains("clean"));
  EXPECT_DOUBLE_EQ(json["distances"]["heldOutPercent"]["max"].get<double>(), 8);
}

TEST(LocalSpacing, agreesWithBruteForce)
{
  Random random(3);
  // Ten densities, a million units away from the origin, some points twice.
  const Vector3d far(1e6, -2e6, 5e5);
  Points points;
  for (int i = 0; i < 600; ++i)
    points.emplace_back(far + std::pow(2., i % 10) * random.inCube());
  points.insert(points.end(), points.begin(), points.begin() + 50);
  pcl::mrf::Execution execution(2);
  const LocalSpacing local(points, execution);
  const std::vector<LocalSpacing::Nearest> own = local.nearest(points, execution);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::vector<double> distances;
    for (std::size_t j = 0; j < 600; ++j)
      if (points[j] != points[i])
        distances.push_back((points[j] - points[i]).norm());
    std::nth_element(distances.begin(), distances.begin() + 7, distances.end());
    EXPECT_NEAR(own[i].spacing, .313 * distances[7], rounding) << "point " << i;
  }

  Points places;
  for (int i = 0; i < 500; ++i)
    places.emplace_back(far + 3000 * random.inCube());
  const std::vector<LocalSpacing::Nearest> nearest = local.nearest(places, execution);
  for (std::size_t i = 0; i < places.size(); ++i) {
    double least = std::numeric_limits<double>::infinity();
    for (const Vector3d& point : points)
      least = std::min(least, (point - places[i]).norm());
    // Which of almost equals is nearest is decided in floats, in a frame of a few thousand units.
    EXPECT_NEAR(nearest[i].distance, least, 1e-3);
  }
}

TEST(LocalSpacing, needsNinePlaces)
{
  pcl::mrf::Execution execution(1);
  Points points = lattice(3, 3, 1);
  EXPECT_TRUE(LocalSpacing(points, execution).isKnown());
  points.back() = points.front();
  EXPECT_FALSE(LocalSpacing(points, execution).isKnown()) << "eight places";
  EXPECT_FALSE(LocalSpacing({}, execution).isKnown());
}

TEST(Evaluate, distancesInLocalSpacings)
{
  // A fine and a coarse lattice before one plane: what is far from it for the fine one is near for the coarse one.
  const double side = .1, coarseSide = 1;
  const int fine = 30, coarse = 20;
  EvaluationInput input;
  input.cloud = lattice(fine, fine, side);
  const Points coarsePoints = lattice(coarse, coarse, coarseSide, {10, 0, 0});
  input.cloud.insert(input.cloud.end(), coarsePoints.begin(), coarsePoints.end());
  // Eight spacings of the fine lattice. On its border the 8th neighbor is two sides away, so that it is 5.7 spacings
  // there, next to a corner √5 sides (5.05 spacings), but at the corners two diagonals: 4.
  const double height = 8 * latticeSpacing * side;
  const SurfaceMesh mesh = rectangle(60, 40, 1, height);
  input.heldOut = {{.55, .55, height - .3}};
  const Evaluation evaluation = measured(moved(mesh, {-10, -10, 0}), input);
  ASSERT_TRUE(evaluation.local.has_value());
  const LocalComparison& local = *evaluation.local;
  EXPECT_NEAR(local.spacing, latticeSpacing * side, rounding) << "most points are in the fine lattice";
  EXPECT_NEAR(local.unevenness, coarseSide / side, 1e-10);
  EXPECT_NEAR(local.cloudRms, 8, 1e-10);
  EXPECT_NEAR(*local.heldOutRms, .3 / (latticeSpacing * side), 1e-10);
  EXPECT_DOUBLE_EQ(local.nearShare, (4. + coarse * coarse) / (fine * fine + coarse * coarse));
  EXPECT_FALSE(local.flippedShare.has_value()) << "the cloud has no normals";
  const nlohmann::ordered_json json = toJson(evaluation);
  EXPECT_EQ(json["local"]["nearShare"], local.nearShare);
  EXPECT_EQ(json["local"]["heldOutRms"], *local.heldOutRms);
  EXPECT_FALSE(json["local"].contains("flippedShare"));
  EXPECT_NE(toText(json).find("heldOutRms"), std::string::npos);

  input.cloud.resize(8);
  EXPECT_FALSE(measured(mesh, input).local.has_value()) << "a spacing takes nine points";
  EXPECT_FALSE(toJson(measured(mesh)).contains("local"));
}

TEST(Evaluate, inventedAreaInLocalSpacings)
{
  // Points on the left half of a strip, which is so long that the border of the points hardly counts.
  const double side = .01;
  EvaluationInput input;
  input.cloud = lattice(101, 201, side);
  const SurfaceMesh mesh = rectangle(20, 20, .1, 0);
  const double share = measured(mesh, input).local->inventedShare;
  // Along the border the 8th neighbor is two sides away. At the two corners it is .83 sides farther, of which ten
  // times .313 in a strip of one side in two hundred: less than the samples tell apart.
  EXPECT_NEAR(share, (1 - 10 * .313 * 2 * side) / 2, 1e-3);
  // The same by the pieces' own measure: ten times the spacing, ten times the reach.
  input.cloud = lattice(11, 21, 10 * side);
  EXPECT_NEAR(measured(mesh, input).local->inventedShare, (1 - 10 * .313 * 2 * 10 * side) / 2, 1e-2);
}

TEST(Evaluate, flippedNormals)
{
  SurfaceMesh mesh = sphere(4, 2);
  EvaluationInput input;
  std::int64_t flipped = 0, normals = 0;
  for (const Vector3d& vertex : sphere(3, 2.01).vertices) {
    input.cloud.push_back(vertex);
    const std::size_t i = input.cloud.size();
    const double sign = i % 7 == 0 ? -1 : i % 5 == 0 ? 0 : 3;
    input.cloudNormals.push_back((sign * vertex).cast<float>());
    flipped += sign < 0 ? 1 : 0;
    normals += sign != 0 ? 1 : 0;
  }
  // A point that is left out takes its normal with it.
  input.cloud.insert(input.cloud.begin(), Vector3d::Constant(std::nan("")));
  input.cloudNormals.insert(input.cloudNormals.begin(), Eigen::Vector3f(0, 0, 1));
  const double share = static_cast<double>(flipped) / static_cast<double>(normals);
  EXPECT_DOUBLE_EQ(*measured(mesh, input).local->flippedShare, share);
  for (auto& triangle : mesh.triangles)
    std::swap(triangle[0], triangle[1]);
  EXPECT_DOUBLE_EQ(*measured(mesh, input).local->flippedShare, 1 - share);
}

TEST(Evaluate, countsOnBrokenMeshes)
{
  const Evaluation sound = measured(tetrahedron());
  EXPECT_EQ(sound.mesh.components, 1);
  EXPECT_EQ(sound.mesh.eulerCharacteristic, 2);
  EXPECT_EQ(sound.selfIntersectingTriangles, 0);

  SurfaceMesh degenerate = tetrahedron();
  degenerate.vertices.emplace_back(.25, 0, 0);
  degenerate.triangles.push_back({0, 0, 1});
  degenerate.triangles.push_back({0, 4, 1});
  EXPECT_EQ(measured(degenerate).mesh.degenerateTriangles, 2);
  EXPECT_EQ(measured(degenerate).selfIntersectingTriangles, 0) << "they are counted once";

  SurfaceMesh crossing = tetrahedron();
  for (const Vector3d& vertex : tetrahedron(Vector3d(.2, .2, -.5)).vertices)
    crossing.vertices.push_back(vertex);
  for (const auto& [a, b, c] : tetrahedron().triangles)
    crossing.triangles.push_back({a + 4, b + 4, c + 4});
  // The second one's sides x = .2 and y = .2 and its slanted one pass through the bottom, its bottom is below; its tip
  // (.2, .2, .5) stays below the slanted side of the first one.
  EXPECT_EQ(measured(crossing).selfIntersectingTriangles, 4);
}

TEST(Evaluate, histogramOfAreas)
{
  // Right triangles with one side of length 2: the other one is the area.
  const auto ofAreas = [](const std::vector<double>& areas) {
    SurfaceMesh mesh;
    for (std::size_t t = 0; t < areas.size(); ++t) {
      const auto z = static_cast<double>(t);
      const auto first = static_cast<std::int32_t>(mesh.vertices.size());
      mesh.vertices.insert(mesh.vertices.end(), {{0, 0, z}, {2, 0, z}, {0, areas[t], z}});
      mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return measured(mesh);
  };
  const Evaluation two = ofAreas({11, 29});
  EXPECT_EQ(two.areas[5], 1) << "11/20 = .55";
  EXPECT_EQ(two.areas[14], 1) << "29/20 = 1.45";
  EXPECT_NEAR(two.areaVariance(), .2025, 1e-6) << "(9/20)², of float vertices";
  const Evaluation uneven = ofAreas({1, 1, 1, 1, 1, 1, 1, 1, 1, 31});
  EXPECT_EQ(uneven.areas[2], 9) << "1/4 of the mean";
  EXPECT_EQ(uneven.areas.back(), 1) << "7.75 means";
  const Evaluation empty = ofAreas({1, 0});
  EXPECT_EQ(empty.areas[0], 1) << "a triangle without area";
  EXPECT_EQ(empty.areas[20], 1);

  const Evaluation round = measured(sphere(3, 1));
  EXPECT_EQ(std::accumulate(round.areas.begin(), round.areas.end(), std::int64_t{0}), round.mesh.triangles);
  const nlohmann::json json = toJson(uneven);
  EXPECT_EQ(json["mesh"]["areas"].size(), uneven.areas.size());
  EXPECT_EQ(json["mesh"]["areas"][2], 9);
  EXPECT_NEAR(json["mesh"]["areaVariance"].get<double>(), 81. / 16, 1e-5) << "mean 4, squares 97: (97 − 16)/16";
}

TEST(Evaluate, refusesWhatCannotBeMeasured)
{
  const SurfaceMesh sound = tetrahedron();
  SurfaceMesh flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  flat.triangles = {{0, 1, 2}};
  SurfaceMesh lost = flat;
  lost.vertices[2] = Vector3d::Constant(std::nan(""));
  for (const SurfaceMesh& mesh : {SurfaceMesh(), flat, lost}) {
    EXPECT_THROW(measured(mesh), pcl::mrf::InvalidInput);
    EXPECT_THROW(measured(sound, against(mesh)), pcl::mrf::InvalidInput);
  }
  EvaluationInput input;
  input.cloud = {Vector3d::Zero()};
  EXPECT_THROW(measured(sound, input), pcl::mrf::InvalidInput) << "a single point has no diagonal";
}

TEST(VertexErrors, toReferenceOrNearestPoint)
{
  pcl::mrf::Execution execution(2);
  SurfaceMesh mesh = rectangle(4, 4, .25, .5);
  mesh.vertices[3].x() = std::nan("");
  EvaluationInput input = against(rectangle(4, 4, .25, 0));
  const auto expectAt = [&](std::size_t vertex, double error) {
    // Results are floats.
    EXPECT_NEAR(vertexErrors(mesh, input, execution)[vertex], error, 1e-6 * error);
  };
  EXPECT_TRUE(std::isnan(vertexErrors(mesh, input, execution)[3]));
  expectAt(0, .5);
  input.reference.reset();
  EXPECT_THROW(vertexErrors(mesh, input, execution), pcl::mrf::InvalidInput);
  input.cloud = {{0, 0, .25}};
  expectAt(0, .25);
  expectAt(1, std::hypot(.25, .25));
  input.heldOut = {{.25, 0, .4}};
  expectAt(1, .1);
  input.clean = {{0, 0, .49}};
  expectAt(0, .01);
}

/// Gaussian errors whose standard deviations are the reported sigmas, which have two values; half of them in fillings.
std::vector<SigmaSample> gaussianErrors(double factor)
{
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  std::vector<SigmaSample> samples;
  for (int n = 0; n < 40000; ++n) {
    const double sigma = n % 4 < 2 ? 1 : 3;
    samples.push_back({std::abs(sigma * normal(random)), factor * sigma, n % 2 == 0 ? 1. : 0., 1});
  }
  return samples;
}

TEST(SigmaEvaluation, CoversWhatIsGaussian)
{
  const SigmaEvaluation right = evaluateSigma(gaussianErrors(1), 10);
  // Four standard errors of a share of 20000.
  for (const SigmaStatistics& statistics : {right.measured, right.fillings}) {
    EXPECT_EQ(statistics.count, 20000);
    for (std::size_t level = 0; level < 3; ++level)
      EXPECT_NEAR(statistics.coverage[level], SigmaStatistics::levels[level], .0142);
  }
  EXPECT_NEAR(right.measured.rmsError, std::sqrt(5.), .1) << "of one and nine";
  // Wrong widths cover more or less, and are told by the likelihood either way.
  const SigmaEvaluation wide = evaluateSigma(gaussianErrors(2), 10), narrow = evaluateSigma(gaussianErrors(.5), 10);
  EXPECT_GT(wide.measured.coverage[2], .99);
  EXPECT_LT(narrow.measured.coverage[2], .75);
  EXPECT_GT(wide.measured.negativeLogLikelihood, right.measured.negativeLogLikelihood);
  EXPECT_GT(narrow.measured.negativeLogLikelihood, right.measured.negativeLogLikelihood);
}

TEST(SigmaEvaluation, SparsificationRanksPredictors)
{
  std::vector<SigmaSample> samples = gaussianErrors(1);
  const SigmaEvaluation honest = evaluateSigma(samples, 10);
  EXPECT_GT(honest.sparsification.sigma, 0);
  EXPECT_LT(honest.sparsification.sigma, .9 * honest.sparsification.confidence)
      << "sigma knows the size, the confidence nothing";
  for (SigmaSample& sample : samples)
    sample.sigma = sample.error + 1e-9;
  EXPECT_NEAR(evaluateSigma(samples, 10).sparsification.sigma, 0, 1e-9) << "the errors themselves";
  EXPECT_EQ(evaluateSigma({{1, 0, 1, 1}, {1, 1, 1, 1}}, 10).notKnown, 1);
}
