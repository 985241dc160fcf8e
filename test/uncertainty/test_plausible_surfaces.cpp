// SPDX-License-Identifier: BSD-3-Clause
// Surfaces that sigma allows for: how far they are from each other, and what they say about volumes.
#include "support/clouds.h"
#include "support/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace pcl::mrf;

namespace {

Options withSurfaces(int surfaces, int samples = 8)
{
  Options options;
  options.uncertainty.surfaces = surfaces;
  options.uncertainty.samples = samples;
  return options;
}

PointSet spherePoints(double spacing, double noise = 0, unsigned seed = 1)
{
  PointSet points = shapes::sample([](const Eigen::Vector3d& x) { return x.norm() - 1; }, 1.2, spacing, seed);
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

TEST(PlausibleSurfaces, MoveNeighborsTogether)
{
  const Reconstruction result = clouds::reconstruct(withHole(spherePoints(.1, .01)), withSurfaces(32, 32));
  const auto together = [&](std::size_t a, std::size_t b) {
    double product = 0;
    for (const std::vector<float>& surface : result.surfaces)
      product += static_cast<double>(surface[a]) * static_cast<double>(surface[b]);
    return product / static_cast<double>(result.surfaces.size()) /
           std::sqrt(meanSquare(result, a) * meanSquare(result, b));
  };
  double neighbors = 0, fillings = 0, others = 0, inFilling = 0;
  const std::size_t count = result.mesh.triangles.size();
  for (std::size_t t = 0; t < count; ++t) {
    const auto at = [&](std::size_t triangle) { return static_cast<std::size_t>(result.mesh.triangles[triangle][0]); };
    const auto next = static_cast<std::size_t>(result.mesh.triangles[t][1]);
    neighbors += together(at(t), next) / static_cast<double>(count);
    if (!(result.mesh.confidences[at(t)] > 0)) {
      fillings += together(at(t), next);
      ++inFilling;
    }
    const std::size_t other = (t + count / 2) % count;
    if ((result.mesh.vertices[at(t)] - result.mesh.vertices[at(other)]).norm() > .5f)
      others += together(at(t), at(other)) / static_cast<double>(count);
  }
  ASSERT_GT(inFilling, 0);
  EXPECT_GT(neighbors, .3) << "an edge is about a voxel, which is as far as points smooth each other's noise";
  EXPECT_GT(fillings / inFilling, .7) << "a filling bulges as a whole, but at its rim";
  EXPECT_LT(std::abs(others), .2) << "what is far away errs on its own, but for the share of the voxels' offset";
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

TEST(PlausibleSurfaces, IntervalsAreStudents)
{
  // Tables of Student's t give 12.706, 2.365 and 1.984 for 1, 7 and 99 degrees of freedom.
  for (const auto& [samples, quantile] : {std::pair(2, 12.7062), {8, 2.36462}, {100, 1.98422}}) {
    const SampledShape shape =
        clouds::reconstruct(spherePoints(.2, .01), withSurfaces(1, samples)).report.uncertainty.shape;
    ASSERT_EQ(shape.surfaces, samples);
    for (const SampledQuantity& quantity : {shape.volume, shape.area, shape.extent[0], shape.extent[2]}) {
      EXPECT_GT(quantity.deviation, 0);
      EXPECT_NEAR((quantity.lower + quantity.upper) / 2, quantity.mean, 1e-9 * quantity.mean);
      EXPECT_NEAR(half(quantity) / quantity.deviation, quantile * std::sqrt(1 + 1. / samples), 1e-4 * quantile);
    }
  }
}

TEST(PlausibleSurfaces, OfAnOpenMeshHaveNoVolume)
{
  const PointSet part = shapes::filter(spherePoints(.1), [](const Eigen::Vector3f& p) { return p.z() < 0; });
  const SampledShape shape = clouds::reconstruct(part, withSurfaces(1)).report.uncertainty.shape;
  EXPECT_FALSE(shape.isClosed);
  EXPECT_EQ(shape.volume.upper, 0);
  EXPECT_GT(shape.area.lower, 5);
  EXPECT_LT(shape.area.upper, 8);
}

TEST(PlausibleSurfaces, AreTheSameForAnyThreads)
{
  const PointSet points = withHole(spherePoints(.1, .01));
  const Reconstruction one = clouds::reconstruct(points, withSurfaces(3), 1),
                       two = clouds::reconstruct(points, withSurfaces(3), 2);
  EXPECT_EQ(one.surfaces, two.surfaces);
  EXPECT_EQ(one.report.uncertainty.shape.volume.lower, two.report.uncertainty.shape.volume.lower);
  EXPECT_EQ(one.report.uncertainty.shape.area.upper, two.report.uncertainty.shape.area.upper);
}

TEST(PlausibleSurfaces, AreAsManyAsAskedFor)
{
  const PointSet points = spherePoints(.2, .01);
  const Reconstruction many = clouds::reconstruct(points, withSurfaces(12)), none = clouds::reconstruct(points, [] {
                                                                               Options options;
                                                                               options.uncertainty.compute = true;
                                                                               return options;
                                                                             }());
  EXPECT_EQ(many.surfaces.size(), 12u);
  EXPECT_EQ(many.report.uncertainty.samples, 12) << "more draws than by default";
  EXPECT_EQ(many.mesh.sigmas.size(), many.mesh.vertices.size()) << "they need sigma";
  EXPECT_TRUE(none.surfaces.empty());
  EXPECT_EQ(none.report.uncertainty.shape.surfaces, 8) << "intervals come without";
  // The first draws are the same ones.
  EXPECT_EQ(many.mesh.vertices, none.mesh.vertices);
}

TEST(PlausibleSurfaces, OfPiecesFarApartMoveOnTheirOwn)
{
  const PointSet one = spherePoints(.15, .01);
  PointSet other = one;
  for (Eigen::Vector3f& p : other.positions)
    p.x() += 200;
  PointSet both = one;
  clouds::append(both, other);
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

TEST(Displaced, MovesAlongTheNormals)
{
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.normals = {{0, 0, 1}, {1, 0, 0}, {0, 0, -1}};
  mesh.triangles = {{0, 1, 2}};
  const TriangleMesh moved = displaced(mesh, {1, 2, 3});
  EXPECT_EQ(moved.vertices, (std::vector<Eigen::Vector3f>{{0, 0, 1}, {3, 0, 0}, {0, 1, -3}}));
  EXPECT_EQ(moved.triangles, mesh.triangles);
}

} // namespace
