// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/vertex_fields.h"
#include "support/clouds.h"
#include "support/meshes.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <pcl/surface/mrf/options.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace meshes;
using namespace pcl::mrf;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

TEST(VertexFields, normalsOfASphereConverge)
{
  std::vector<double> errors;
  for (const int voxels : {20, 40}) {
    const DistanceField field = shapes::field(shapes::sphere(.7), 1, voxels);
    TriangleMesh mesh = zeroLevel(field);
    setNormals(mesh, field, serial);
    ASSERT_EQ(mesh.normals.size(), mesh.vertices.size());
    double largest = 0;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      EXPECT_NEAR(mesh.normals[v].norm(), 1, 1e-6);
      largest = std::max<double>(largest, (mesh.normals[v] - mesh.vertices[v].normalized()).norm());
    }
    errors.push_back(largest);
  }
  // Trilinear interpolation of central differences: (h/R)² times a small factor.
  EXPECT_LT(errors[0], std::pow(.1 / .7, 2));
  EXPECT_LT(errors[1], errors[0] / 3);
}

TEST(VertexFields, confidencesFallWithTheDistanceFromTheNearestPoint)
{
  OrientedPoints points;
  points.positions = {{0, 0, 0}, {10, 0, 0}};
  points.normals.assign(2, Vector3f::UnitZ());
  points.confidences = {1, .5f};
  const auto search = clouds::searchOf(points);
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 3, 0}, {0, 0, 4.5f}, {10, 1, 0}};
  setConfidences(mesh, {points, *search, 4, 0}, ConfidenceShape::linear, serial);
  const std::vector<float> linear = {1, .75f, .25f, 0, .5f * .75f};
  ASSERT_EQ(mesh.confidences.size(), linear.size());
  for (std::size_t v = 0; v < linear.size(); ++v)
    EXPECT_FLOAT_EQ(mesh.confidences[v], linear[v]);
  setConfidences(mesh, {points, *search, 4, 0}, ConfidenceShape::quadratic, serial);
  EXPECT_FLOAT_EQ(mesh.confidences[1], 1 - 1.f / 16);
  EXPECT_EQ(mesh.confidences[3], 0);
}

TEST(VertexFields, confidencesDoNotDependOnWhichVertexCameBefore)
{
  // Points of two densities, the reach following them, and vertices that walk away from them, back, and to others.
  OrientedPoints points;
  for (int i = 0; i < 20; ++i) {
    points.positions.emplace_back(.1f * static_cast<float>(i), 0, 0);
    points.positions.emplace_back(50 + static_cast<float>(i), 0, 0);
    points.spacings.insert(points.spacings.end(), {.1f, 1});
  }
  points.normals.assign(points.positions.size(), Vector3f::UnitZ());
  const auto search = clouds::searchOf(points);
  const Support support(points, *search, .5f, .1f);
  TriangleMesh mesh;
  for (int step = 0; step < 3000; ++step)
    mesh.vertices.emplace_back(40 - 40 * std::cos(.003f * static_cast<float>(step)),
                               6 * std::sin(.05f * static_cast<float>(step)), 0);
  setConfidences(mesh, support, ConfidenceShape::quadratic, serial);
  Neighbors scratch;
  int supported = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const float alone = support.confidence(mesh.vertices[v], ConfidenceShape::quadratic, scratch);
    ASSERT_EQ(mesh.confidences[v], alone) << "vertex " << v;
    supported += alone > 0 ? 1 : 0;
  }
  EXPECT_GT(supported, 100);
  EXPECT_LT(supported, 2900);
}

TEST(VertexFields, pointsSupportSurfaceWithinThreeOfTheirDeviations)
{
  OrientedPoints points;
  points.positions = {{0, 0, 0}, {10, 0, 0}, {20, 0, 0}};
  points.normals.assign(3, Vector3f::UnitZ());
  points.deviations = {.1f, .25f, 9};
  const auto search = clouds::searchOf(points);
  const Support support(points, *search, .5f, 0);
  EXPECT_FLOAT_EQ(support.reach(0), .5f) << "dEmax is more";
  EXPECT_FLOAT_EQ(support.reach(1), .75f);
  EXPECT_FLOAT_EQ(support.reach(2), 2) << "four times dEmax at most";
  EXPECT_FLOAT_EQ(support.farthestReach(), 2);
  Neighbors scratch;
  EXPECT_FLOAT_EQ(support.confidence({20, 0, 1}, ConfidenceShape::quadratic, scratch), .75f);
}

TEST(VertexFields, sparsePointsSupportSurfaceBetweenThemIfTheyLieEvenly)
{
  for (const float ratio : {1.f, .05f}) { // of the distance across rows to that along them
    OrientedPoints points;
    for (int n = 0; n < 49; ++n)
      points.positions.emplace_back(9 * static_cast<float>(n % 7), 9 * ratio * static_cast<float>(n / 7), 0);
    points.normals.assign(points.positions.size(), Vector3f::UnitZ());
    points.spacings.assign(points.positions.size(), 9);
    const auto search = clouds::searchOf(points);
    const Support support(points, *search, .5f, .1f);
    EXPECT_FLOAT_EQ(support.reach(24), ratio == 1 ? 30 : 2) << ratio;
    EXPECT_FLOAT_EQ(support.farthestReach(), 30);
  }
}

TEST(VertexFields, edgesAreAsLongAsThePointsAreSparse)
{
  // On a line at distances of 1, 1.7, 2, 3 and 9.
  OrientedPoints points;
  points.spacings = {1, 1.7f, 2, 3, 9};
  for (std::size_t n = 0; n < points.spacings.size(); ++n)
    points.positions.emplace_back(10 * static_cast<float>(n), 0, 0);
  points.normals.assign(points.positions.size(), Vector3f::UnitZ());
  const auto search = clouds::searchOf(points);
  TriangleMesh mesh;
  for (const Vector3f& p : points.positions)
    mesh.vertices.push_back(p + Vector3f(2, 0, 1));
  const EdgeSizing sizing = edgeSizing(mesh, {points, *search, 3, 1}, serial);
  const std::vector<float> expected = {1, 1, 1.5f, 3, 9};
  ASSERT_EQ(sizing.size(), expected.size());
  for (std::size_t v = 0; v < expected.size(); ++v)
    EXPECT_FLOAT_EQ(sizing[v], expected[v]);

  EXPECT_TRUE(edgeSizing(mesh, {points, *search, 3, 0}, serial).empty()) << "one length for the cloud, as the paper";
  points.spacings.assign(points.spacings.size(), 1.7f);
  EXPECT_TRUE(edgeSizing(mesh, {points, *search, 3, 1}, serial).empty()) << "none is sparse";
}

TEST(VertexFields, trianglesGiveTheNormalWhereTheGradientVanishes)
{
  // A field without any slope, and a roof of two triangles and an unused vertex in it.
  const DistanceField field({{4, 4, 4}}, std::vector<float>(64, 1.f), std::vector<float>(64, .5f));
  TriangleMesh mesh;
  mesh.vertices = {{1, 1, 2}, {1, 2, 2}, {0, 1, 1}, {2, 1, 1}, {3, 3, 3}};
  mesh.triangles = {{1, 2, 0}, {1, 0, 3}}; // two slopes that meet in the ridge 0–1
  setNormals(mesh, field, serial);
  const Vector3f left = Vector3f(-1, 0, 1).normalized(), right = Vector3f(1, 0, 1).normalized();
  EXPECT_LT((mesh.normals[0] - Vector3f::UnitZ()).norm(), 1e-6f);
  EXPECT_LT((mesh.normals[1] - Vector3f::UnitZ()).norm(), 1e-6f);
  EXPECT_LT((mesh.normals[2] - left).norm(), 1e-6f);
  EXPECT_LT((mesh.normals[3] - right).norm(), 1e-6f);
  EXPECT_NEAR(mesh.normals[4].norm(), 1, 1e-6);
}

class Attributes : public ::testing::Test {
protected:
  Attributes() : search_(makeKdTree())
  {
    points_ = shapes::sample(shapes::sphere(1), 1.2, .08);
    search_->setPoints(points_.positions);
  }

  std::vector<float> interpolate(const std::vector<Vector3f>& at, const std::vector<float>& values, int channels,
                                 int threads = 1) const
  {
    Execution execution(threads);
    const auto count = static_cast<std::size_t>(channels);
    return interpolateAttributes(
        at, *search_,
        [&](std::size_t point, float* ofPoint) { std::copy_n(values.data() + point * count, count, ofPoint); },
        channels, execution);
  }

  PointSet points_;
  std::unique_ptr<NeighborSearch> search_;
};

TEST_F(Attributes, areWeightedMeansOfTheFourNearest)
{
  std::vector<float> values;
  for (const Vector3f& x : points_.positions) {
    values.push_back(x.x());
    values.push_back(7);
  }
  std::vector<Vector3f> between;
  for (std::size_t p = 0; p + 1 < points_.size(); p += 5)
    between.push_back(points_.positions[p] + Vector3f(.02f, -.015f, .01f));
  const std::vector<float> result = interpolate(between, values, 2);
  ASSERT_EQ(result.size(), 2 * between.size());
  for (std::size_t v = 0; v < between.size(); ++v) {
    std::vector<std::pair<double, double>> all; // squared distance, value
    for (const Vector3f& x : points_.positions)
      all.emplace_back((x - between[v]).cast<double>().squaredNorm(), x.x());
    std::sort(all.begin(), all.end());
    double sum = 0, weights = 0;
    for (std::size_t n = 0; n < 4; ++n) {
      sum += all[n].second / all[n].first;
      weights += 1 / all[n].first;
    }
    EXPECT_NEAR(result[2 * v], sum / weights, 1e-4); // squared distances are float: 1e-7 of 1 against about 1e-3
    EXPECT_NEAR(result[2 * v + 1], 7, 1e-5);
  }
}

TEST_F(Attributes, coincidentCloseAndFewPointsDoNoHarm)
{
  search_->setPoints({{0, 0, 0}, {0, 0, 0}, {1e-20f, 0, 0}, {1, 0, 0}, {2, 0, 0}});
  const std::vector<float> result = interpolate({{0, 0, 0}, {1e-21f, 0, 0}, {1, 0, 0}}, {5, 5, 5, 1, 2}, 1);
  EXPECT_EQ(result[0], 5);
  EXPECT_NEAR(result[1], 5, 1e-6);
  EXPECT_EQ(result[2], 1);
  search_->setPoints({{0, 0, 0}, {1, 0, 0}});
  EXPECT_NEAR(interpolate({{.5f, 0, 0}}, {2, 4}, 1)[0], 3, 1e-6);
  search_->setPoints({{0, 0, 0}});
  EXPECT_EQ(interpolate({{.5f, 0, 0}}, {2}, 1)[0], 2);
}

TEST_F(Attributes, fieldsDoNotDependOnThreads)
{
  const DistanceField field = shapes::field(shapes::torus(.6, .25), 1, 40);
  const TriangleMesh mesh = zeroLevel(field);
  sameOnAnyThreads([&](int threads) {
    Execution execution(threads);
    TriangleMesh own = mesh;
    setNormals(own, field, execution);
    return own.normals;
  });
  std::vector<float> values;
  for (const Vector3f& x : points_.positions)
    values.push_back(x.y());
  sameOnAnyThreads([&](int threads) { return interpolate(mesh.vertices, values, 1, threads); });
}

TEST(ConfidenceColor, runsFromBlueToSkin)
{
  const Rgb blue = confidenceColor(0), skin = confidenceColor(1);
  EXPECT_GT(blue[2], std::max(blue[0], blue[1]) + 50);
  EXPECT_GT(skin[0], skin[1]);
  EXPECT_GT(skin[1], skin[2]);
  EXPECT_EQ(confidenceColor(-3), blue);
  EXPECT_EQ(confidenceColor(NAN), blue);
  EXPECT_EQ(confidenceColor(4), skin);
  const Rgb middle = confidenceColor(.5f);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(middle[c], (blue[c] + skin[c]) / 2., 1); // rounding
}

} // namespace
