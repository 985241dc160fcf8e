// SPDX-License-Identifier: BSD-3-Clause
// Error bars: what sigma says beside the true error, and what must not change it.
#include "support/cancelling.h"
#include "support/clouds.h"
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

double sphereDistance(const Eigen::Vector3d& x)
{
  return x.norm() - 1;
}

PointSet torusPoints(double spacing, unsigned seed = 1)
{
  return shapes::sample(shapes::torus(.8, .35), 1.2, spacing, seed);
}

/// Without the points within a distance of some directions.
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

double median(std::vector<float> values)
{
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return static_cast<double>(values[values.size() / 2]);
}

/// Share of the vertices whose distance to the truth is within 1.96 sigma.
double coverage(const Reconstruction& result, const shapes::Sdf& truth, bool ofFillings)
{
  int all = 0, within = 0;
  for (std::size_t v = 0; v < result.mesh.vertices.size(); ++v) {
    if (ofFillings == (result.mesh.confidences[v] > 0))
      continue;
    const Eigen::Vector3d at = (result.mesh.vertices[v].cast<double>() + result.points.offset);
    ++all;
    within += std::abs(truth(at)) <= 1.96 * static_cast<double>(result.mesh.sigmas[v]) ? 1 : 0;
  }
  EXPECT_GT(all, 0);
  return static_cast<double>(within) / all;
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
    EXPECT_GE(coverage(result, shapes::torus(.8, .35), false), .85);
    EXPECT_GE(coverage(result, shapes::torus(.8, .35), true), .75);
    // Half-widths: no coverage by width alone.
    double squares = 0, count = 0;
    for (std::size_t v = 0; v < result.mesh.vertices.size(); ++v)
      if (result.mesh.confidences[v] > 0) {
        squares += std::pow(shapes::torus(.8, .35)(result.mesh.vertices[v].cast<double>() + result.points.offset), 2);
        ++count;
      }
    // A torus is smoother than the scanned objects that tell how much of the noise comes through.
    EXPECT_LE(1.96 * report.measured.median, 5 * std::sqrt(squares / count));
    if (noise > 0) {
      EXPECT_NEAR(report.noise, noise, .35 * noise) << "a few hundred pairs, some of which see shape, too";
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
      const auto from = static_cast<std::size_t>(corners[c]),
                 to = static_cast<std::size_t>(corners[(c + 1) % corners.size()]);
      if (mesh.confidences[from] > 0 && !(mesh.confidences[to] > 0))
        ratios.push_back(mesh.sigmas[to] / mesh.sigmas[from]);
    }
  ASSERT_GE(ratios.size(), 100u) << "three rims";
  // Fillings have some 50 times the sigma of measured surface. An edge is a third of what a point supports and half of
  // it lies before the border: a third of the way up, 50^(1/3).
  EXPECT_LT(median(ratios), 3.7);
  EXPECT_GT(result.report.uncertainty.fillings.median, 3.7 * result.report.uncertainty.measured.median);

  double within = 0, all = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (mesh.confidences[v] > 0 && mesh.confidences[v] < .6f) {
      const Eigen::Vector3d at = mesh.vertices[v].cast<double>() + result.points.offset;
      ++all;
      within += std::abs(shapes::torus(.8, .35)(at)) <= 1.96 * static_cast<double>(mesh.sigmas[v]) ? 1 : 0;
    }
  EXPECT_GE(all, 100);
  EXPECT_GE(within / all, .85);
}

TEST(Uncertainty, CoversWherePointsAreFarApart)
{
  // One half of a torus has four times as many points as the other, all with the same noise.
  const auto isDense = [](const Eigen::Vector3f& p) { return p.x() > 0; };
  PointSet points = shapes::filter(torusPoints(.03), isDense);
  const PointSet sparse = shapes::filter(torusPoints(.06, 2), [&](const Eigen::Vector3f& p) { return !isDense(p); });
  points.positions.insert(points.positions.end(), sparse.positions.begin(), sparse.positions.end());
  points.normals.insert(points.normals.end(), sparse.normals.begin(), sparse.normals.end());
  shapes::addNoise(points, .004);
  const Reconstruction result = clouds::reconstruct(points, withUncertainty());
  std::vector<float> sigmas[2];
  double within[2] = {0, 0};
  for (std::size_t v = 0; v < result.mesh.vertices.size(); ++v) {
    const Eigen::Vector3d at = result.mesh.vertices[v].cast<double>() + result.points.offset;
    if (std::abs(at.x()) < .2) // where both meet
      continue;
    const int half = at.x() > 0 ? 0 : 1;
    const float sigma = result.mesh.sigmas[v];
    sigmas[half].push_back(sigma);
    within[half] += std::abs(shapes::torus(.8, .35)(at)) <= 1.96 * static_cast<double>(sigma) ? 1 : 0;
  }
  for (const int half : {0, 1})
    EXPECT_GE(within[half] / static_cast<double>(sigmas[half].size()), .9) << half;
  // A mean of a quarter of the points has twice the error.
  EXPECT_NEAR(median(sigmas[1]) / median(sigmas[0]), 2, .6);
}

TEST(Uncertainty, NoiseIsToldOnALattice)
{
  // Four neighbors are equally near; the one next in height would tell less than the noise.
  constexpr float noise = .1f;
  PointSet points = clouds::lattice(100, 1);
  std::mt19937 random(5);
  std::normal_distribution<float> normal(0, noise);
  for (Eigen::Vector3f& p : points.positions)
    p.z() = normal(random);
  const UncertaintyReport report = clouds::reconstruct(points, withUncertainty()).report.uncertainty;
  EXPECT_GE(report.heldOut, 200);
  // Some hundred pairs leave 5 %, and the surface's own errors add as much.
  EXPECT_NEAR(report.noise, static_cast<double>(noise), .2 * static_cast<double>(noise));
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
  EXPECT_GE(coverage(result, box, false), .9);
  double squares = 0;
  for (const Eigen::Vector3f& v : result.mesh.vertices)
    squares += std::pow(box(v.cast<double>() + result.points.offset), 2);
  const double rms = std::sqrt(squares / static_cast<double>(result.mesh.vertices.size()));
  EXPECT_LE(1.96 * result.report.uncertainty.measured.median, 3 * rms) << "not by width";
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
  const Reconstruction one = clouds::reconstruct(points, withUncertainty(), 1),
                       three = clouds::reconstruct(points, withUncertainty(), 3),
                       shuffled = clouds::reconstruct(clouds::reordered(points, clouds::shuffledOrder(points.size())),
                                                      withUncertainty(), 2);
  EXPECT_EQ(one.mesh.sigmas, three.mesh.sigmas);
  EXPECT_EQ(one.mesh.calibrated, three.mesh.calibrated);
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

TEST(Uncertainty, FewPointsAreNoFailure)
{
  const PointSet few = shapes::sample(sphereDistance, 1.2, .6);
  ASSERT_LT(few.size(), 60u);
  const Reconstruction result = clouds::reconstruct(few, withUncertainty());
  ASSERT_EQ(result.mesh.sigmas.size(), result.mesh.vertices.size());
  for (const float sigma : result.mesh.sigmas)
    EXPECT_TRUE(std::isfinite(sigma) && sigma > 0);
}

TEST(Uncertainty, AnExactPlaneHasOneToo)
{
  // Nothing that is left out is off: what remains is rounding, but no zero and nothing that is not finite.
  const PointSet plane = shapes::filter(
      clouds::lattice(40, .1f), [](const Eigen::Vector3f& p) { return (p - Eigen::Vector3f(2, 2, 0)).norm() > .6f; });
  const Reconstruction result = clouds::reconstruct(plane, withUncertainty());
  ASSERT_EQ(result.mesh.sigmas.size(), result.mesh.vertices.size());
  for (const float sigma : result.mesh.sigmas)
    EXPECT_TRUE(std::isfinite(sigma) && sigma > 0 && sigma < .1f) << sigma;
}

TEST(Uncertainty, IsRefusedWhereVoxelsObserve)
{
  Options options = withUncertainty();
  options.observation.kind = ObservationKind::plane;
  const std::string message = clouds::messageOf<InvalidOption>([&] { clouds::reconstruct(torusPoints(.2), options); });
  EXPECT_NE(message.find("observation.kind = points"), std::string::npos) << message;
}

TEST(Uncertainty, IsCancelled)
{
  const PointSet cloud = withHoles(torusPoints(.06), .3f);
  bool wasReached = false;
  Execution execution(2, [&](const std::string& stage, double) {
    wasReached = wasReached || stage == "uncertainty";
    return stage != "uncertainty";
  });
  RawCloud raw;
  raw.positions = cloud.positions;
  raw.normals = cloud.normals;
  EXPECT_THROW(reconstruct(std::move(raw), withUncertainty(), execution), Cancelled);
  EXPECT_TRUE(wasReached);
}

TEST(Uncertainty, FollowsTheVerticesOfASelection)
{
  TriangleMesh mesh;
  mesh.vertices.resize(5, Eigen::Vector3f::Zero());
  mesh.triangles = {{0, 1, 2}, {2, 3, 4}};
  mesh.sigmas = {1, 2, 3, 4, 5};
  mesh.calibrated = {1, 0, 1, 0, 1};
  const TriangleMesh kept = select(mesh, {0, 1});
  EXPECT_EQ(kept.sigmas, (std::vector<float>{3, 4, 5}));
  EXPECT_EQ(kept.calibrated, (std::vector<std::uint8_t>{1, 0, 1}));
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

} // namespace
