// SPDX-License-Identifier: BSD-3-Clause
// The whole method on shapes with known truth, and changes of the input that must not change its result.
#include "mesh/self_intersection.h"
#include "support/clouds.h"
#include "support/contract.h"
#include "support/depth_image.h"
#include "support/meshes.h"
#include "support/random.h"
#include "support/scans.h"
#include "support/shapes.h"

#include <Eigen/Geometry>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

using pcl::mrf::PointSet;
using pcl::mrf::TriangleMesh;

namespace {

struct Outcome {
  TriangleMesh mesh;
  pcl::mrf::Report report;
};

Outcome reconstruct(const PointSet& points, const pcl::mrf::Options& options = {})
{
  contract::On<pcl::PointNormal> mrf(points);
  mrf.setOptions(options);
  return {contract::run(mrf), mrf.getReport()};
}

/// RMS of the exact distance at the vertices.
double error(const TriangleMesh& mesh, const shapes::Sdf& truth)
{
  std::vector<double> distances;
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    distances.push_back(truth(vertex.cast<double>()));
  return rootMeanSquare(distances);
}

double maxDistance(const TriangleMesh& from, const TriangleMesh& to)
{
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& vertex : from.vertices)
    points.push_back(vertex.cast<double>());
  const std::vector<double> distances = distancesToMesh(points, to);
  return *std::max_element(distances.begin(), distances.end());
}

/// The larger of the two one-sided distances, measured at the vertices.
double hausdorff(const TriangleMesh& a, const TriangleMesh& b)
{
  return std::max(maxDistance(a, b), maxDistance(b, a));
}

PointSet mapped(PointSet points, const Eigen::Affine3f& there)
{
  for (Eigen::Vector3f& p : points.positions)
    p = there * p;
  for (Eigen::Vector3f& n : points.normals)
    n = (there.linear() * n).normalized();
  return points;
}

TriangleMesh mapped(TriangleMesh mesh, const Eigen::Affine3f& there)
{
  for (Eigen::Vector3f& vertex : mesh.vertices)
    vertex = there * vertex;
  return mesh;
}

/// A shape without symmetry, so that no invariance holds by accident.
shapes::Sdf lopsided()
{
  return shapes::unite(shapes::sphere(.8), shapes::tube({0, 0, 0}, {.9, .7, .4}, .45));
}

const PointSet& lopsidedPoints()
{
  static const PointSet points = shapes::sample(lopsided(), 1.7, .1);
  return points;
}

const Outcome& lopsidedRun()
{
  static const Outcome run = reconstruct(lopsidedPoints());
  return run;
}

void expectClosed(const Outcome& run, int components, int eulerCharacteristic)
{
  const pcl::mrf::MeshStatistics statistics = pcl::mrf::measure(run.mesh);
  EXPECT_TRUE(statistics.closed());
  meshes::expectSound(statistics);
  EXPECT_EQ(statistics.components, components);
  EXPECT_EQ(statistics.eulerCharacteristic, eulerCharacteristic);
  EXPECT_TRUE(pcl::mrf::selfIntersectingTriangles(run.mesh).empty());
  EXPECT_EQ(run.report.intersectingBeforeRemeshing, 0);
  EXPECT_EQ(run.report.intersecting, 0);
  EXPECT_GT(statistics.meanQuality, .9) << "remeshed";
}

/// Appends points with random normals, anywhere in a box.
void addOutliers(PointSet& points, std::size_t count, const Eigen::Vector3f& half)
{
  clouds::Random random(1);
  for (; count > 0; --count) {
    const Eigen::Vector3f position = half.cwiseProduct(random.inCube().cast<float>());
    clouds::append(points, position, random.direction().cast<float>());
  }
}

struct Truth {
  shapes::Sdf sdf;
  double radius, volume, area; ///< the smallest radius of curvature
  int components, eulerCharacteristic;
  std::vector<double> spacings;
};

} // namespace

TEST(Analytic, ShapesConvergeWithTheSampling)
{
  const shapes::Sdf tubes =
      shapes::unite(shapes::tube({-.8, 0, -.4}, {.8, 0, -.4}, .25), shapes::tube({0, -.8, .4}, {0, .8, .4}, .25));
  const double ofTubes = 2 * M_PI * .25 * (1.6 + 4. / 3 * .25) * .25;
  const Truth truths[] = {
      {shapes::sphere(1), 1, 4 * M_PI / 3, 4 * M_PI, 1, 2, {.2, .1, .05}},
      {shapes::torus(1, .4), .4, 2 * M_PI * M_PI * .16, 4 * M_PI * M_PI * .4, 1, 0, {.12, .06}},
      {tubes, .25, ofTubes, 2 * 2 * M_PI * .25 * (1.6 + 2 * .25), 2, 4, {.06}},
  };
  for (const Truth& truth : truths) {
    double last = std::numeric_limits<double>::infinity();
    for (const double spacing : truth.spacings) {
      // Left to the data, voxels of a smooth shape are not proportional to the spacing.
      pcl::mrf::Options options;
      options.multiscale.voxelSize = static_cast<float>(2 * spacing);
      const Outcome run = reconstruct(shapes::sample(truth.sdf, 1.6, spacing), options);
      expectClosed(run, truth.components, truth.eulerCharacteristic);
      const double rms = error(run.mesh, truth.sdf);
      std::cout << "spacing " << spacing << ": rms " << rms << ", volume " << run.report.mesh.volume << '\n';
      // Planes instead of the surface, and linear interpolation across a voxel: both are of second order in the
      // spacing, which the voxel size follows. A ratio of 4 is expected; of first order it would be 2.
      EXPECT_LT(rms, last / 2.8);
      last = rms;
      // Triangles of edge e with their corners on a sphere take 3/8 e² of its volume off; with e = h = 2 spacing that
      // is 1.5 spacing². Fitted ones lie on it in the mean: a fifteenth of it is left; on a torus' inner half more.
      const double relative = std::pow(spacing / truth.radius, 2), ofVolume = truth.radius == 1 ? .1 : 2;
      EXPECT_NEAR(run.report.mesh.volume, truth.volume, ofVolume * relative * truth.volume);
      EXPECT_NEAR(run.report.mesh.area, truth.area, 2 * relative * truth.area);
    }
  }
}

TEST(Analytic, PatchIsTrimmedToItsPoints)
{
  const double spacing = .06;
  const shapes::Sdf truth = shapes::sphere(2, {0, 0, -2});
  const PointSet points = shapes::filter(shapes::sample(truth, 1.5, spacing), [](const Eigen::Vector3f& p) {
    return std::hypot(p.x(), p.y()) < 1 && p.z() > -1;
  });
  const Outcome run = reconstruct(points);
  const pcl::mrf::MeshStatistics statistics = pcl::mrf::measure(run.mesh);
  EXPECT_TRUE(statistics.manifold());
  EXPECT_EQ(statistics.components, 1);
  EXPECT_EQ(statistics.boundaryLoops, 1);
  EXPECT_EQ(statistics.eulerCharacteristic, 1);
  EXPECT_GT(run.report.trimming.extrapolationsDropped, 0);
  // The remesher sees what is left only, and keeps its border: triangles inside cut corners of the sphere by less.
  EXPECT_EQ(run.report.meshBeforeRemeshing.boundaryLoops, 1);
  EXPECT_NEAR(run.report.meshBeforeRemeshing.area, statistics.area, .01 * statistics.area);
  // Support ends dEmax = 3 l̄ behind the last points; a triangle needs one supported vertex: one edge more, h = 2 l̄.
  double farthest = 0;
  for (const Eigen::Vector3f& vertex : run.mesh.vertices)
    farthest = std::max(farthest, std::hypot(static_cast<double>(vertex.x()), static_cast<double>(vertex.y())));
  EXPECT_GT(farthest, 1 - spacing);
  EXPECT_LT(farthest, 1 + 7 * spacing);
  // Between the points the surface is observed; beyond them it goes on as the prior bends it.
  const double h = run.report.options.multiscale.voxelSize;
  for (const Eigen::Vector3f& vertex : run.mesh.vertices) {
    const bool between = std::hypot(vertex.x(), vertex.y()) < 1 - h;
    EXPECT_LT(std::abs(truth(vertex.cast<double>())), (between ? .05 : .5) * h) << vertex.transpose();
  }

  pcl::mrf::Options all;
  all.trimming.kind = pcl::mrf::Trimming::none;
  EXPECT_GT(reconstruct(points, all).report.mesh.area, 1.2 * statistics.area) << "without trimming a sheet goes on";
}

TEST(Sampling, SparsePartsGetLongEdges)
{
  // A third of a plane has sixteen times the points of the rest.
  const shapes::Sdf plane = shapes::plane({0, 0, 1});
  const PointSet dense = shapes::sample(plane, 1, .02), sparse = shapes::sample(plane, 1, .08, 2);
  PointSet points;
  for (const PointSet* part : {&dense, &sparse})
    for (std::size_t i = 0; i < part->size(); ++i)
      if ((part->positions[i].x() < -.3f) == (part == &dense))
        clouds::append(points, part->positions[i], part->normals[i]);
  const auto trianglesFrom = [](const pcl::mrf::TriangleMesh& mesh, float x) {
    return std::count_if(mesh.triangles.begin(), mesh.triangles.end(),
                         [&](const pcl::mrf::Triangle& t) { return mesh.vertices[t[0]].x() > x; });
  };
  const Outcome run = reconstruct(points);
  EXPECT_TRUE(run.report.mesh.manifold());
  EXPECT_EQ(run.report.mesh.eulerCharacteristic, 1);
  EXPECT_GT(run.report.mesh.meanQuality, .93);
  EXPECT_TRUE(pcl::mrf::selfIntersectingTriangles(run.mesh).empty());
  EXPECT_LT(error(run.mesh, plane), .01 * run.report.options.multiscale.voxelSize);

  pcl::mrf::Options even;
  even.remesher.targetEdge = run.report.options.remesher.targetEdge;
  const Outcome uniform = reconstruct(points, even);
  EXPECT_LT(trianglesFrom(run.mesh, .2f), .15 * static_cast<double>(trianglesFrom(uniform.mesh, .2f)));
  const auto near = [&](const Outcome& outcome) {
    return static_cast<double>(outcome.mesh.triangles.size()) - static_cast<double>(trianglesFrom(outcome.mesh, -.4f));
  };
  EXPECT_NEAR(near(run), near(uniform), .02 * near(uniform)) << "the dense part's stay as they are";
}

TEST(Sampling, FewTrianglesAreWhereTheNoiseIsLess)
{
  const PointSet points = shapes::sample(shapes::sphere(1), 1.2, .05);
  const auto ratio = [&](float noiseOfHalf) { // of the triangles of two halves
    pcl::mrf::RawCloud cloud = clouds::raw(points.positions, points.normals);
    for (const Eigen::Vector3f& p : points.positions)
      cloud.deviations.push_back(p.x() > 0 ? .001f : noiseOfHalf);
    pcl::mrf::Options options;
    options.remesher.triangles = 600;
    pcl::mrf::Execution execution(2);
    const TriangleMesh mesh = reconstruct(std::move(cloud), options, execution).mesh;
    const auto isExact = [&](const pcl::mrf::Triangle& t) {
      return mesh.vertices[t[0]].x() + mesh.vertices[t[1]].x() + mesh.vertices[t[2]].x() > 0;
    };
    const auto exact = std::count_if(mesh.triangles.begin(), mesh.triangles.end(), isExact);
    return static_cast<double>(exact) / static_cast<double>(mesh.triangles.size() - exact);
  };
  EXPECT_NEAR(ratio(.001f), 1, .15);
  EXPECT_GT(ratio(.03f), 2);
}

TEST(Sampling, StrongNoiseIsNotFollowedByBubbles)
{
  // White, of 1.6 spacings where the plane y = 1 is near and .9 where it is far. A field that bends enough passes near
  // every point that is left out.
  const auto result = clouds::reconstruct(depth_image::plane([](float depth) { return .02f * depth * depth; }, 0));
  EXPECT_GT(result.report.noise.deviation, 0);
  EXPECT_EQ(result.report.smoothing.heldOut, 0);
  const auto& [vertices, triangles] = std::tie(result.mesh.vertices, result.mesh.triangles);
  double area = 0, flat = 0;
  for (const pcl::mrf::Triangle& t : triangles) {
    const Eigen::Vector3f across = (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]);
    area += static_cast<double>(across.norm());
    flat += static_cast<double>(std::abs(across.y()));
  }
  EXPECT_GT(flat, .97 * area);
}

TEST(Sampling, NormalsThatStrongNoiseScattersAreFittedAgain)
{
  const shapes::Sdf torus = shapes::torus(1, .4);
  PointSet points = shapes::sample(torus, 1.6, .04);
  shapes::addNoise(points, .1);
  const auto areFitted = [](const Outcome& run) {
    const auto isOfNormals = [](const std::string& text) { return text.find("the normals are") == 0; };
    const std::vector<std::string>& warnings = run.report.warnings;
    EXPECT_EQ(std::count_if(warnings.begin(), warnings.end(), isOfNormals), run.report.normalsEstimated ? 1 : 0);
    return run.report.normalsEstimated;
  };
  const Outcome exact = reconstruct(points);
  EXPECT_FALSE(areFitted(exact)) << "these are better";
  clouds::Random random(1);
  for (Eigen::Vector3f& normal : points.normals)
    normal = (normal + .8f * random.direction().cast<float>()).normalized();
  const Outcome scattered = reconstruct(points);
  EXPECT_TRUE(areFitted(scattered));
  EXPECT_EQ(scattered.report.vote, pcl::mrf::OrientationVote::reference);
  for (const Outcome& run : {exact, scattered})
    EXPECT_GE(run.report.options.multiscale.voxelSize, run.report.options.observation.smoothing);
  expectClosed(scattered, 1, 0);
  EXPECT_LT(error(scattered.mesh, torus), 1.3 * error(exact.mesh, torus));
}

TEST(Sampling, FivePercentOfOutliersLeaveOneComponent)
{
  const shapes::Sdf torus = shapes::torus(1, .4);
  PointSet points = shapes::sample(torus, 1.6, .05);
  shapes::addNoise(points, .3 * .05);
  addOutliers(points, points.size() / 20, {1.6f, 1.6f, .6f});
  const Outcome run = reconstruct(points);
  expectClosed(run, 1, 0);
  EXPECT_GT(run.report.points.outliersAlone, 0);
  EXPECT_NEAR(run.report.smoothing.noise, .3 * .05, .1 * .05);
  // Averaging makes of the noise a fraction.
  EXPECT_LT(error(run.mesh, torus), .5 * .3 * .05);
}

TEST(Sampling, SmallObjectsBesideALargeOneSurvive)
{
  // Of .5 and 1 % of the points, sampled as densely; the outliers leave nothing.
  const shapes::Sdf large = shapes::sphere(1), small = shapes::sphere(.1, {1.3, 0, 0}),
                    smallest = shapes::sphere(.07, {0, 1.3, 0});
  const shapes::Sdf all = shapes::unite(large, shapes::unite(small, smallest));
  PointSet points = shapes::sample(all, 1.5, .02);
  addOutliers(points, points.size() / 100, Eigen::Vector3f::Constant(1.5f));
  const Outcome run = reconstruct(points);
  expectClosed(run, 3, 6);
  EXPECT_LT(error(run.mesh, all), .1 * run.report.options.multiscale.voxelSize);
}

TEST(Determinism, SameBytesForAnyOrderAndNumberOfThreads)
{
  const PointSet& points = lopsidedPoints();
  pcl::mrf::Options options;
  for (const int threads : {1, 2, 4}) {
    options.threads = threads;
    const auto order = clouds::shuffledOrder(points.size(), static_cast<unsigned>(threads));
    const Outcome run = reconstruct(clouds::reordered(points, order), options);
    EXPECT_EQ(run.report.threads, threads);
    EXPECT_TRUE(conversion::sameBytes(run.mesh, lopsidedRun().mesh)) << threads << " threads";
  }
}

TEST(Invariance, MotionsAndScale)
{
  const PointSet& points = lopsidedPoints();
  const Outcome& here = lopsidedRun();
  const double h = here.report.options.multiscale.voxelSize;
  pcl::mrf::Options asCut;
  asCut.remesher.rounds = 0;
  const TriangleMesh cut = reconstruct(points, asCut).mesh;
  // Rounding flips decisions of the remesher, and other triangles cut other corners off: e²/8 of the curvature 1/0.45
  // on each side, with e up to 4/3 of the target edge, which is about h; in the crease between the two the curvature
  // is half as much again. Before remeshing only rounding is left: of coordinates below 2^12, before and after, or of
  // the decisions of the stages, a hundredth of a voxel. A lattice that lies elsewhere cuts the shape elsewhere: both
  // results differ from the truth by their discretization, which is largest in the crease.
  const double corners = 3 * 16. / 9 * h * h / 8 / .45, crease = .4 * h;
  const Eigen::Vector3f shift = Eigen::Vector3f(1000, -700, 400) * static_cast<float>(here.report.diagonal);
  const auto turned = [](float angle) {
    return Eigen::Affine3f(Eigen::AngleAxisf(angle, Eigen::Vector3f(1, 2, -.5f).normalized()));
  };
  const struct {
    const char* name;
    Eigen::Affine3f there;
    double remeshed, cut; ///< largest distances
  } cases[] = {{"far away", Eigen::Affine3f(Eigen::Translation3f(shift)), corners, 8 * 0x1p-13},
               // Powers of two, which change no digit, are test_faults'.
               {"small", Eigen::Affine3f(Eigen::Scaling(1e-3f)), corners, .01 * h},
               {"large", Eigen::Affine3f(Eigen::Scaling(1e3f)), corners, .01 * h},
               {"turned by .3", turned(.3f), crease, crease},
               {"turned by 1.1", turned(1.1f), crease, crease}};
  for (const auto& pose : cases) {
    SCOPED_TRACE(pose.name);
    const Eigen::Affine3f back = pose.there.inverse();
    const PointSet there = mapped(points, pose.there);
    const Outcome run = reconstruct(there);
    expectClosed(run, 1, 2);
    EXPECT_TRUE(run.report.warnings.empty());
    EXPECT_LT(hausdorff(mapped(run.mesh, back), here.mesh), pose.remeshed);
    EXPECT_LT(hausdorff(mapped(reconstruct(there, asCut).mesh, back), cut), pose.cut);
    EXPECT_NEAR(run.report.mesh.volume * static_cast<double>(back.linear().determinant()), here.report.mesh.volume,
                .005 * here.report.mesh.volume);
  }
}

TEST(Triangles, TooFewForTheTopologyAreWarnedOf)
{
  pcl::mrf::Options options;
  options.remesher.triangles = 2000;
  Outcome run = reconstruct(lopsidedPoints(), options);
  EXPECT_NEAR(static_cast<double>(run.mesh.triangles.size()), 2000, 40);
  EXPECT_TRUE(run.report.warnings.empty());
  options.remesher.triangles = 2;
  run = reconstruct(lopsidedPoints(), options);
  EXPECT_TRUE(run.report.mesh.closed());
  ASSERT_EQ(run.report.warnings.size(), 1u);
  EXPECT_NE(run.report.warnings.front().find("(2), but the mesh has "), std::string::npos)
      << run.report.warnings.front();
}

TEST(Invariance, CoarseInputIsWarnedOf)
{
  const double h = lopsidedRun().report.options.multiscale.voxelSize;
  // The float spacing at the shifted position is a power of two just above a tenth of a voxel.
  const double resolution = std::exp2(std::ceil(std::log2(.1 * h)));
  const auto shift = static_cast<float>(resolution * 0x1p23 * 1.5);
  const Outcome run = reconstruct(mapped(lopsidedPoints(), Eigen::Affine3f(Eigen::Translation3f(shift, 0, 0))));
  ASSERT_FALSE(run.report.warnings.empty());
  EXPECT_NE(run.report.warnings.front().find("offset"), std::string::npos) << run.report.warnings.front();
  EXPECT_EQ(run.report.mesh.components, 1);
}

TEST(Invariance, ShortMemory)
{
  const PointSet points = shapes::sample(shapes::torus(1, .4), 1.6, .014);
  pcl::mrf::Options options;
  options.multiscale.voxelSize = .014f;
  options.multiscale.denseVoxels = 1 << 15;
  const Outcome whole = reconstruct(points, options);
  ASSERT_EQ(whole.report.levels.back().tiles, 1);
  options.multiscale.maxMemory = static_cast<std::size_t>(.8 * static_cast<double>(whole.report.predictedBytes));
  const Outcome tiled = reconstruct(points, options);
  EXPECT_GT(tiled.report.levels.back().tiles, 1);
  EXPECT_TRUE(tiled.report.mesh.closed());
  EXPECT_EQ(tiled.report.mesh.eulerCharacteristic, whole.report.mesh.eulerCharacteristic);
  EXPECT_EQ(tiled.report.mesh.components, 1);
  EXPECT_EQ(tiled.report.intersecting, 0);
  EXPECT_GT(*std::min_element(tiled.mesh.confidences.begin(), tiled.mesh.confidences.end()), 0)
      << "told by the search, which rested before";
  // Remeshed in parts, which ends with other vertices.
  EXPECT_NE(tiled.mesh.vertices.size(), whole.mesh.vertices.size());
  EXPECT_LT(hausdorff(tiled.mesh, whole.mesh), .1 * .014);
  EXPECT_NEAR(tiled.report.mesh.meanQuality, whole.report.mesh.meanQuality, .01);
}

TEST(Invariance, RotationOfThePapersSphereWithoutItsCap)
{
  // Fig. 9: exact normals, random points, no axis that is one of the grid's.
  constexpr float radius = 40;
  const float capsCosine = std::cos(37 * static_cast<float>(M_PI) / 180);
  PointSet points;
  clouds::Random random(1);
  while (points.size() < 18000) {
    const Eigen::Vector3f normal = random.direction().cast<float>();
    if (-normal.z() < capsCosine)
      clouds::append(points, radius * normal, normal);
  }
  pcl::mrf::Options options = pcl::mrf::paperPreset();
  options.multiscale.voxelSize = 2;
  options.normals.source = pcl::mrf::NormalSource::use;
  options.remesher.rounds = 0;
  const auto reconstructTurned = [&](float degrees) {
    const Eigen::Affine3f there(
        Eigen::AngleAxisf(degrees * static_cast<float>(M_PI) / 180, Eigen::Vector3f(1, 2, 3).normalized()));
    const Outcome run = reconstruct(mapped(points, there), options);
    EXPECT_TRUE(run.report.mesh.closed()) << "its volume has room for all of the surface";
    EXPECT_EQ(run.report.mesh.eulerCharacteristic, 2);
    return mapped(run.mesh, there.inverse());
  };
  const TriangleMesh straight = reconstructTurned(0);
  for (const float degrees : {30.f, 45.f}) {
    const double distance = hausdorff(reconstructTurned(degrees), straight);
    std::cout << "turned by " << degrees << " degrees: at most " << distance << " apart\n";
    // The paper has 2.47 as the largest distance. .29 was measured; ICM's stop is no sharp one.
    EXPECT_LT(distance, .6);
  }
}
