// SPDX-License-Identifier: BSD-3-Clause
// Surface that may be too far off goes, and nothing else.
#include "support/clouds.h"
#include "support/shapes.h"
#include "trimming/error_limit.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace pcl::mrf;

namespace {

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
  PointSet points = shapes::sample([](const Eigen::Vector3d& x) { return x.norm() - 1; }, 1.2, .06);
  points = shapes::filter(points, [](const Eigen::Vector3f& p) { return (p - Eigen::Vector3f(0, 0, 1)).norm() > .5f; });
  shapes::addNoise(points, .003);
  return points;
}

/// Between the half-widths of nearly all measured surface and those of most of the filling.
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
  const int side = 9;
  TriangleMesh mesh;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      mesh.vertices.emplace_back(static_cast<float>(x), static_cast<float>(y), 0);
      mesh.confidences.push_back(1);
      const bool isStrip = y <= 1 && x > 0, isPatch = y >= 4 && y <= 6 && x >= 2 && x <= 4;
      mesh.sigmas.push_back(isStrip || isPatch ? 1.f : 3.f);
    }
  for (int y = 0; y + 1 < side; ++y)
    for (int x = 0; x + 1 < side; ++x) {
      const std::int32_t v = y * side + x;
      mesh.triangles.push_back({v, v + 1, v + side + 1});
      mesh.triangles.push_back({v, v + side + 1, v + side});
    }
  const ErrorLimitSummary dropped = limitSigma(mesh, 2);
  // The strip lies at the mesh's own border, where a vertex is inside with the triangles that it has.
  for (const Eigen::Vector3f& v : mesh.vertices)
    EXPECT_TRUE(v.y() <= 1 || (v.y() >= 4 && v.y() <= 6 && v.x() >= 2 && v.x() <= 4)) << v.transpose();
  EXPECT_EQ(
      std::count_if(mesh.vertices.begin(), mesh.vertices.end(), [](const Eigen::Vector3f& v) { return v.y() > 3; }), 7)
      << "around the middle of the patch; its other two corners hang on by one triangle each";
  EXPECT_EQ(dropped.triangles + static_cast<std::int64_t>(mesh.triangles.size()), 2 * (side - 1) * (side - 1));
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
