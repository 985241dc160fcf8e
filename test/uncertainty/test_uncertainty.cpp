// SPDX-License-Identifier: BSD-3-Clause
// Error bars: sigma compared with the true error, and changes that must not affect it.
#include "base/select_values.h"
#include "support/cancelling.h"
#include "support/clouds.h"
#include "support/depth_image.h"
#include "support/shapes.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace pcl::mrf;

namespace {

Options withUncertainty()
{
  Options options;
  options.uncertainty.compute = true;
  return options;
}

PointSet torusPoints(double spacing, unsigned seed = 1)
{
  return shapes::sample(shapes::torus(.8, .35), 1.2, spacing, seed);
}

/// The points without those closer than a radius to several directions.
PointSet withHoles(const PointSet& points, float radius)
{
  return shapes::filter(points, [&](const Eigen::Vector3f& p) {
    for (const Eigen::Vector3f& at :
         {Eigen::Vector3f(1.15f, 0, 0), Eigen::Vector3f(0, .8f, .35f), Eigen::Vector3f(-.69f, -.92f, 0)})
      if ((p - at).norm() < radius)
        return false;
    return true;
  });
}

Eigen::Vector3d positionOf(const Reconstruction& result, std::size_t vertex)
{
  return result.mesh.vertices[vertex].cast<double>() + result.points.offset;
}

/// For a set of vertices: the share whose distance to the truth is within 1.96 sigma, the RMS of that distance, the
/// median sigma.
struct Coverage {
  double share, rms, sigma, count;
};

/// The coverage of the vertices for which isAsked(vertex) is true.
template <typename IsAsked>
Coverage coverageOf(const Reconstruction& result, const shapes::Sdf& truth, const IsAsked& isAsked)
{
  double all = 0, within = 0, squares = 0;
  std::vector<float> sigmas;
  for (std::size_t v = 0; v < result.mesh.vertices.size(); ++v)
    if (isAsked(v)) {
      const double error = std::abs(truth(positionOf(result, v)));
      ++all;
      within += error <= 1.96 * static_cast<double>(result.mesh.sigmas[v]) ? 1 : 0;
      squares += error * error;
      sigmas.push_back(result.mesh.sigmas[v]);
    }
  EXPECT_GT(all, 0);
  return {within / all, std::sqrt(squares / all), median(sigmas), all};
}

Coverage coverage(const Reconstruction& result, const shapes::Sdf& truth, bool ofFillings)
{
  return coverageOf(result, truth, [&](std::size_t v) { return ofFillings != (result.mesh.confidences[v] > 0); });
}

TEST(Uncertainty, IsThereOnlyIfAskedFor)
{
  const PointSet points = torusPoints(.1);
  const Reconstruction plain = clouds::reconstruct(points), barred = clouds::reconstruct(points, withUncertainty());
  EXPECT_TRUE(plain.mesh.sigmas.empty());
  EXPECT_FALSE(plain.report.uncertainty.isComputed);
  EXPECT_EQ(plain.mesh.vertices, barred.mesh.vertices) << "it changes nothing else";
  ASSERT_EQ(barred.mesh.sigmas.size(), barred.mesh.vertices.size());
  ASSERT_EQ(barred.mesh.calibrated.size(), barred.mesh.vertices.size());
  for (const float sigma : barred.mesh.sigmas)
    EXPECT_TRUE(std::isfinite(sigma) && sigma > 0) << sigma;
  EXPECT_TRUE(barred.report.uncertainty.isComputed);
  EXPECT_EQ(barred.report.uncertainty.patches, 0) << "nothing is open";
  EXPECT_EQ(barred.report.uncertainty.fillings.vertices, 0);
  EXPECT_GE(barred.report.uncertainty.heldOut, 20);

  Options colored;
  colored.colors = ColorMode::sigma;
  EXPECT_EQ(clouds::reconstruct(points, colored).mesh.sigmas, barred.mesh.sigmas) << "colors need it";
}

TEST(Uncertainty, CoversTheErrorAmidDataAndInFillings)
{
  // One object and three holes are no statistics: the bars here catch a factor of two, those over many scans are
  // measured by pcl_mrf_evaluate --sigma.
  for (const double noise : {0., .01}) {
    SCOPED_TRACE(noise);
    PointSet points = withHoles(torusPoints(.04), .25f);
    if (noise > 0)
      shapes::addNoise(points, noise);
    const Reconstruction result = clouds::reconstruct(points, withUncertainty());
    const UncertaintyReport& report = result.report.uncertainty;
    EXPECT_GE(report.patches, 3);
    EXPECT_GT(report.fillings.median, report.measured.median);
    const Coverage measured = coverage(result, shapes::torus(.8, .35), false);
    EXPECT_GE(measured.share, .85);
    EXPECT_GE(coverage(result, shapes::torus(.8, .35), true).share, .75);
    // Half-widths: no coverage by width alone. A torus is smoother than the scanned objects that tell how much of the
    // noise comes through.
    EXPECT_LE(1.96 * report.measured.median, 5 * measured.rms);
    if (noise > 0) {
      EXPECT_NEAR(report.noise, noise, .35 * noise) << "a few hundred pairs, some of which see shape, too";
    }
  }
}

TEST(Uncertainty, CoversAtEveryRangeWhatNeighborsShare)
{
  Options options = withUncertainty();
  options.trimming.kind = Trimming::supported;
  for (const bool isLittle : {false, true}) {
    const float atOne = isLittle ? .0012f : .005f;
    const Reconstruction result =
        clouds::reconstruct(depth_image::plane([&](float depth) { return atOne * depth * depth; }, 2), options);
    ASSERT_EQ(result.report.noise.isCorrelated, !isLittle);
    ASSERT_EQ(result.report.noise.lengthening > 1, isLittle);
    if (isLittle) {
      EXPECT_NEAR(result.report.smoothingLength, result.report.noise.lengthening * result.report.smoothing.smoothing,
                  1e-6);
    }
    const shapes::Sdf plane = [](const Eigen::Vector3d& p) { return 1 - p.y(); };
    double before = 0;
    for (const float nearest : {1.1f, 1.5f, 2.f, 2.5f}) {
      SCOPED_TRACE(nearest);
      const auto isAsked = [&](std::size_t v) {
        const double range = positionOf(result, v).norm();
        return result.mesh.confidences[v] > 0 && range > nearest && range < nearest + .4;
      };
      const Coverage found = coverageOf(result, plane, isAsked);
      EXPECT_GE(found.share, isLittle ? .8 : .85);
      EXPECT_LE(found.sigma, 2.5 * found.rms) << "not by width alone";
      EXPECT_GT(found.sigma, 1.1 * before);
      before = found.sigma;
    }
  }
}

TEST(Uncertainty, RisesEvenlyFromDataIntoFillings)
{
  Options options = withUncertainty();
  options.multiscale.voxelSize = .02f; // so that many vertices lie between the last points and the filling
  const Reconstruction result = clouds::reconstruct(withHoles(torusPoints(.04), .25f), options);
  const TriangleMesh& mesh = result.mesh;
  std::vector<float> ratios;
  for (const Triangle& corners : mesh.triangles)
    for (std::size_t c = 0; c < corners.size(); ++c) {
      const std::int32_t from = corners[c], to = corners[(c + 1) % corners.size()];
      if (mesh.confidences[from] > 0 && !(mesh.confidences[to] > 0))
        ratios.push_back(mesh.sigmas[to] / mesh.sigmas[from]);
    }
  ASSERT_GE(ratios.size(), 100u) << "three rims";
  // Fillings have some 50 times the sigma of measured surface. An edge is a third of what a point supports and half of
  // it lies before the border: a third of the way up, 50^(1/3).
  EXPECT_LT(median(ratios), 3.7);
  EXPECT_GT(result.report.uncertainty.fillings.median, 3.7 * result.report.uncertainty.measured.median);

  const auto isAtRim = [&](std::size_t v) { return mesh.confidences[v] > 0 && mesh.confidences[v] < .6f; };
  const Coverage rims = coverageOf(result, shapes::torus(.8, .35), isAtRim);
  EXPECT_GE(rims.count, 100);
  EXPECT_GE(rims.share, .85);
}

TEST(Uncertainty, CoversWherePointsAreFarApart)
{
  // One half of a torus has four times as many points as the other, all with the same noise.
  const auto isDense = [](const Eigen::Vector3f& p) { return p.x() > 0; };
  PointSet points = shapes::filter(torusPoints(.03), isDense);
  clouds::append(points, shapes::filter(torusPoints(.06, 2), [&](const Eigen::Vector3f& p) { return !isDense(p); }));
  shapes::addNoise(points, .004);
  const Reconstruction result = clouds::reconstruct(points, withUncertainty());
  const auto ofHalf = [&](int side) {
    return coverageOf(result, shapes::torus(.8, .35),
                      [&](std::size_t v) { return side * positionOf(result, v).x() > .2; });
  };
  const Coverage dense = ofHalf(1), sparse = ofHalf(-1);
  EXPECT_GE(dense.share, .9);
  EXPECT_GE(sparse.share, .9);
  // A mean of a quarter of the points has twice the error.
  EXPECT_NEAR(sparse.sigma / dense.sigma, 2, .6);
}

TEST(Uncertainty, NoiseIsToldOnALattice)
{
  // Four neighbors are equally near; the one next in height would tell less than the noise. Of a layer thicker than the
  // spacing all that are nearest in space are next in height.
  for (const float noise : {.1f, 2.f}) {
    PointSet points = clouds::lattice(100, 1);
    std::mt19937 random(5);
    std::normal_distribution<float> normal(0, noise);
    for (Eigen::Vector3f& p : points.positions)
      p.z() = normal(random);
    const UncertaintyReport report = clouds::reconstruct(points, withUncertainty()).report.uncertainty;
    EXPECT_GE(report.heldOut, 200);
    // Some hundred pairs leave 5 %, and the surface's own errors add as much; far from a thick layer's middle the field
    // falls behind the distance.
    EXPECT_NEAR(report.noise, static_cast<double>(noise), (noise < 1 ? .2 : .25) * static_cast<double>(noise));
  }
}

TEST(Uncertainty, CoversWhatVoxelsDoToACurvedSurface)
{
  // A box with round corners, on voxels that its faces are content with. At the points left out the field is right;
  // the surface, cut between them, is not.
  const auto box = [](const Eigen::Vector3d& x) {
    const Eigen::Array3d sides(.9, .6, .5), q = x.array().abs() / sides;
    const double norm = std::pow(q.pow(8).sum(), 1. / 8);
    return (norm - 1) / (q.pow(7) * std::pow(norm, -7) / sides).matrix().norm();
  };
  const Reconstruction result = clouds::reconstruct(shapes::sample(box, 1.3, .06), withUncertainty());
  const Coverage measured = coverage(result, box, false);
  EXPECT_GE(measured.share, .9);
  EXPECT_LE(1.96 * result.report.uncertainty.measured.median, 3 * measured.rms) << "not by width";
}

TEST(Uncertainty, ShrinksWithDensity)
{
  // The error of a smooth surface amid exact points falls with the square of their distance at least.
  Options options = withUncertainty();
  options.multiscale.quality = Quality::fine; // voxels as the points, not as fine as is worth it
  const Reconstruction coarse = clouds::reconstruct(torusPoints(.1), options),
                       fine = clouds::reconstruct(torusPoints(.05), options);
  EXPECT_LT(median(fine.mesh.sigmas), .4 * median(coarse.mesh.sigmas));
}

TEST(Uncertainty, HasTheUnitOfTheCloud)
{
  const PointSet points = withHoles(torusPoints(.08), .3f);
  const Reconstruction one = clouds::reconstruct(points, withUncertainty()),
                       thousand = clouds::reconstruct(clouds::scaled(points, 1024), withUncertainty());
  // Numbers are rounded elsewhere, and what is chosen by the data may fall to the other side.
  EXPECT_NEAR(median(thousand.mesh.sigmas) / median(one.mesh.sigmas), 1024, 30);
  EXPECT_EQ(one.report.uncertainty.patches, thousand.report.uncertainty.patches);
}

TEST(Uncertainty, IsTheSameForAnyThreadsAndOrder)
{
  const PointSet points = withHoles(torusPoints(.08), .3f);
  Options drawn = withUncertainty();
  drawn.uncertainty.surfaces = 3;
  const Reconstruction one = clouds::reconstruct(points, drawn, 1), three = clouds::reconstruct(points, drawn, 3),
                       shuffled = clouds::reconstruct(clouds::reordered(points, clouds::shuffledOrder(points.size())),
                                                      withUncertainty(), 2);
  EXPECT_EQ(one.mesh.sigmas, three.mesh.sigmas);
  EXPECT_EQ(one.mesh.calibrated, three.mesh.calibrated);
  EXPECT_EQ(one.surfaces, three.surfaces);
  EXPECT_EQ(one.report.uncertainty.shape.area.upper, three.report.uncertainty.shape.area.upper);
  EXPECT_EQ(one.mesh.sigmas, shuffled.mesh.sigmas);
  Options other = withUncertainty();
  other.solver.seed = 2;
  EXPECT_NE(clouds::reconstruct(points, other).mesh.sigmas, one.mesh.sigmas);
}

TEST(Uncertainty, SaysWhereItIsAnExtrapolation)
{
  // Half a sphere is missing: no disc as large can be left out of the other half.
  const PointSet half = shapes::filter(torusPoints(.06), [](const Eigen::Vector3f& p) { return p.x() < .1f; });
  Options options = withUncertainty();
  options.trimming.kind = Trimming::none;
  const Reconstruction result = clouds::reconstruct(half, options);
  EXPECT_GT(result.report.uncertainty.notCalibrated, 0);
  EXPECT_LT(result.report.uncertainty.largestPatch, result.report.uncertainty.largestOpening);
  std::int64_t flagged = 0;
  for (std::size_t v = 0; v < result.mesh.vertices.size(); ++v)
    flagged += result.mesh.calibrated[v] == 0 ? 1 : 0;
  EXPECT_EQ(flagged, result.report.uncertainty.notCalibrated);
}

TEST(Uncertainty, FewPointsAndAnExactPlaneHaveOneToo)
{
  const PointSet few = shapes::sample(shapes::sphere(1), 1.2, .6);
  ASSERT_LT(few.size(), 60u);
  // Nothing that is left out is off: what remains is rounding, but no zero and nothing that is not finite.
  const PointSet plane = shapes::filter(
      clouds::lattice(40, .1f), [](const Eigen::Vector3f& p) { return (p - Eigen::Vector3f(2, 2, 0)).norm() > .6f; });
  for (const auto& [points, limit] : {std::pair(few, 1e9f), std::pair(plane, .1f)}) {
    const Reconstruction result = clouds::reconstruct(points, withUncertainty());
    ASSERT_EQ(result.mesh.sigmas.size(), result.mesh.vertices.size());
    for (const float sigma : result.mesh.sigmas)
      EXPECT_TRUE(sigma > 0 && sigma < limit) << sigma;
  }
}

TEST(Uncertainty, IsRefusedWhereVoxelsObserveAndCancelled)
{
  Options options = withUncertainty();
  options.observation.kind = ObservationKind::plane;
  const std::string message = clouds::messageOf<InvalidOption>([&] { clouds::reconstruct(torusPoints(.2), options); });
  EXPECT_NE(message.find("observation.kind = points"), std::string::npos) << message;

  const PointSet cloud = withHoles(torusPoints(.06), .3f);
  bool wasReached = false;
  Execution execution(2, [&](const std::string& stage, double) {
    wasReached = wasReached || stage == "uncertainty";
    return stage != "uncertainty";
  });
  EXPECT_THROW(reconstruct(clouds::raw(cloud.positions, cloud.normals), withUncertainty(), execution), Cancelled);
  EXPECT_TRUE(wasReached);
}

TEST(Uncertainty, FollowsTheVerticesOfASelectionWhichMayBeDisplaced)
{
  TriangleMesh mesh;
  mesh.vertices.resize(5, Eigen::Vector3f::Zero());
  mesh.triangles = {{0, 1, 2}, {2, 3, 4}};
  mesh.sigmas = {1, 2, 3, 4, 5};
  mesh.calibrated = {1, 0, 1, 0, 1};
  const TriangleMesh kept = select(mesh, {0, 1});
  EXPECT_EQ(kept.sigmas, (std::vector<float>{3, 4, 5}));
  EXPECT_EQ(kept.calibrated, (std::vector<std::uint8_t>{1, 0, 1}));

  mesh = TriangleMesh();
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.normals = {{0, 0, 1}, {1, 0, 0}, {0, 0, -1}};
  mesh.triangles = {{0, 1, 2}};
  const TriangleMesh moved = displaced(mesh, {1, 2, 3});
  EXPECT_EQ(moved.vertices, (std::vector<Eigen::Vector3f>{{0, 0, 1}, {3, 0, 0}, {0, 1, -3}}));
  EXPECT_EQ(moved.triangles, mesh.triangles);
}

TEST(SigmaColors, RunFromBlueToRed)
{
  std::vector<float> sigmas(100, 1);
  std::fill(sigmas.begin() + 90, sigmas.end(), 7.03f);
  EXPECT_FLOAT_EQ(largestSigmaShown(sigmas), 7.1f);
  EXPECT_GT(largestSigmaShown(std::vector<float>(3, 0.f)), 0);
  const Rgb none = sigmaColor(0, 2), most = sigmaColor(2, 2);
  EXPECT_GT(none[2], none[0]);
  EXPECT_GT(most[0], most[2]);
  EXPECT_EQ(sigmaColor(5, 2), most);
  EXPECT_EQ(sigmaColor(std::nanf(""), 2), most);
  EXPECT_EQ(sigmaColor(-1, 2), none);
}

// Drawn surfaces: how far they are from each other, and the volumes that they give.

Options withSurfaces(int surfaces, int samples = 8)
{
  Options options;
  options.uncertainty.surfaces = surfaces;
  options.uncertainty.samples = samples;
  return options;
}

PointSet spherePoints(double spacing, double noise = 0, unsigned seed = 1)
{
  PointSet points = shapes::sample(shapes::sphere(1), 1.2, spacing, seed);
  if (noise > 0)
    shapes::addNoise(points, noise, seed);
  return points;
}

PointSet withHole(const PointSet& points)
{
  return shapes::filter(points, [](const Eigen::Vector3f& p) { return p.z() < .9f; });
}

bool holds(const SampledQuantity& quantity, double truth)
{
  return quantity.lower <= truth && truth <= quantity.upper;
}

double half(const SampledQuantity& quantity)
{
  return (quantity.upper - quantity.lower) / 2;
}

double meanSquare(const Reconstruction& result, std::size_t v)
{
  double squares = 0;
  for (const std::vector<float>& surface : result.surfaces)
    squares += std::pow(static_cast<double>(surface[v]), 2);
  return squares / static_cast<double>(result.surfaces.size());
}

TEST(PlausibleSurfaces, DeviateBySigma)
{
  const Reconstruction all = clouds::reconstruct(withHole(spherePoints(.1, .01)), withSurfaces(16, 16));
  ASSERT_EQ(all.surfaces.size(), 16u);
  for (std::size_t v = 0; v < all.mesh.vertices.size(); ++v) {
    ASSERT_TRUE(std::isfinite(meanSquare(all, v)));
    EXPECT_NEAR(std::sqrt(meanSquare(all, v)) / static_cast<double>(all.mesh.sigmas[v]), 1, 1e-3) << "floats";
  }
  // Of 64 draws the first 16: by chance as far apart as all, each to 1 / √32, and the thousand vertices of the mesh,
  // some dozens of which are free to move on their own, to a fifth of that.
  const Reconstruction some = clouds::reconstruct(withHole(spherePoints(.1, .01)), withSurfaces(16, 64));
  ASSERT_EQ(some.surfaces.size(), 16u);
  double ratio = 0;
  for (std::size_t v = 0; v < some.mesh.vertices.size(); ++v)
    ratio += std::sqrt(meanSquare(some, v)) / static_cast<double>(some.mesh.sigmas[v]);
  EXPECT_NEAR(ratio / static_cast<double>(some.mesh.vertices.size()), 1, .1);
}

TEST(PlausibleSurfaces, HoldTheVolumeOfASphere)
{
  const double truth = 4 * M_PI / 3;
  for (const double noise : {0., .01}) {
    SCOPED_TRACE(noise);
    int held = 0;
    const int seeds = 6;
    for (unsigned seed = 1; seed <= seeds; ++seed) {
      const Reconstruction result = clouds::reconstruct(spherePoints(.08, noise, seed), withSurfaces(1));
      const SampledShape& shape = result.report.uncertainty.shape;
      ASSERT_TRUE(shape.isClosed);
      EXPECT_EQ(shape.surfaces, 8);
      held += holds(shape.volume, truth) ? 1 : 0;
      EXPECT_LT(half(shape.volume), .005 * truth) << "an interval that holds everything says nothing";
      // The extent is that of a few vertices.
      EXPECT_NEAR(shape.extent[0].mean, 2, .03);
      EXPECT_NEAR(shape.area.mean, 4 * M_PI, .02 * 4 * M_PI) << "triangles cut corners";
    }
    EXPECT_GE(held, seeds - 1) << "95 of 100";
  }
}

TEST(PlausibleSurfaces, AreWiderOverAHole)
{
  // A wide one: what a small one adds is less than what voxels do to the whole sphere.
  const PointSet points = spherePoints(.08);
  Options options = withSurfaces(1);
  options.trimming.kind = Trimming::none;
  const Reconstruction whole = clouds::reconstruct(points, options),
                       open = clouds::reconstruct(
                           shapes::filter(points, [](const Eigen::Vector3f&p) { return p.z() < .7f; }), options);
  ASSERT_TRUE(open.report.uncertainty.shape.isClosed) << "the hole is filled";
  EXPECT_GT(half(open.report.uncertainty.shape.volume), 2 * half(whole.report.uncertainty.shape.volume));
}

TEST(PlausibleSurfaces, AreAsManyAsAskedForAndTheirIntervalsStudents)
{
  // Tables of Student's t give these for one degree of freedom less than there are draws, which are as many as
  // surfaces.
  const struct {
    int surfaces, samples, draws;
    double quantile;
  } cases[] = {{0, 8, 8, 2.36462}, {1, 2, 2, 12.7062}, {12, 8, 12, 2.20099}, {1, 100, 100, 1.98422}};
  for (const auto& asked : cases) {
    Options options = withSurfaces(asked.surfaces, asked.samples);
    options.uncertainty.compute = asked.surfaces == 0; // surfaces need sigma anyway
    const Reconstruction result = clouds::reconstruct(spherePoints(.2, .01), options);
    EXPECT_EQ(result.mesh.sigmas.size(), result.mesh.vertices.size());
    EXPECT_EQ(result.surfaces.size(), static_cast<std::size_t>(asked.surfaces));
    EXPECT_EQ(result.report.uncertainty.samples, asked.draws);
    const SampledShape& shape = result.report.uncertainty.shape;
    ASSERT_EQ(shape.surfaces, asked.draws);
    for (const SampledQuantity& quantity : {shape.volume, shape.area, shape.extent[0], shape.extent[2]}) {
      EXPECT_GT(quantity.deviation, 0);
      EXPECT_NEAR((quantity.lower + quantity.upper) / 2, quantity.mean, 1e-9 * quantity.mean);
      EXPECT_NEAR(half(quantity) / quantity.deviation, asked.quantile * std::sqrt(1 + 1. / asked.draws),
                  1e-4 * asked.quantile);
    }
  }
}

TEST(PlausibleSurfaces, OfPiecesFarApartMoveOnTheirOwn)
{
  const PointSet one = spherePoints(.15, .01);
  PointSet both = one;
  clouds::append(both, one, {200, 0, 0});
  const Reconstruction result = clouds::reconstruct(both, withSurfaces(32, 32));
  ASSERT_EQ(result.report.otherPieces.size(), 1u);
  // Equal spheres on equal grids: how far each moves outward as a whole.
  double product = 0, squares[2] = {0, 0};
  for (const std::vector<float>& surface : result.surfaces) {
    double outward[2] = {0, 0};
    for (std::size_t v = 0; v < surface.size(); ++v)
      outward[(result.mesh.vertices[v].cast<double>() + result.points.offset).x() > 100 ? 1 : 0] +=
          static_cast<double>(surface[v]);
    product += outward[0] * outward[1];
    for (int n = 0; n < 2; ++n)
      squares[n] += outward[n] * outward[n];
  }
  // Independent numbers of 32 draws have a correlation within 3 / √32.
  EXPECT_LT(std::abs(product) / std::sqrt(squares[0] * squares[1]), .53);
}

} // namespace
