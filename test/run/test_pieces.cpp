// SPDX-License-Identifier: BSD-3-Clause
#include "run/pieces.h"

// Clouds in pieces far apart, with their fields and meshes.
#include "support/clouds.h"
#include "support/shapes.h"

#include <pcl/surface/mrf/reconstruction.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace pcl::mrf;

namespace {

PointSet spheres(const std::vector<Eigen::Vector3f>& centers, double spacing = .15)
{
  PointSet points;
  unsigned seed = 0;
  for (const Eigen::Vector3f& center : centers)
    clouds::append(points, shapes::sample(shapes::sphere(1), 1.2, spacing, ++seed), center);
  return points;
}

} // namespace

TEST(FindPieces, SplitsWhatIsFarApartAndNothingElse)
{
  const Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  const auto count = [&](const Eigen::Vector3f& other, float minGap) {
    return findPieces(spheres({origin, other}).positions, minGap).points.size();
  };
  // The diagonal of a sphere's box is 2 √3.
  for (const Eigen::Vector3f& direction :
       {Eigen::Vector3f(1, 0, 0), Eigen::Vector3f(0, 0, -1), Eigen::Vector3f(.6f, -.64f, .48f)}) {
    EXPECT_EQ(count(15 * direction, 1), 0u) << "a gap of less than four diagonals";
    EXPECT_EQ(count(210 * direction, 1), 2u) << "one of fourteen and more";
    EXPECT_EQ(count(210 * direction, 300), 0u) << "less than what is asked for";
  }
  EXPECT_EQ(count({1e6f, 0, 0}, 1e-5f), 2u) << "more cells than can be numbered";
  EXPECT_TRUE(findPieces({}, 1).points.empty());
}

TEST(FindPieces, HoldsEachPointOnceTheLargestFirst)
{
  PointSet points = spheres({{0, 0, 500}});
  clouds::append(points, shapes::sample(shapes::sphere(1), 1.2, .1));
  const std::size_t objects = points.size();
  points.positions.emplace_back(0, 900, 0);
  points.positions.emplace_back(0, 900, .1f);
  const Pieces pieces = findPieces(points.positions, 1);
  ASSERT_EQ(pieces.points.size(), 2u);
  EXPECT_GT(pieces.points[0].size(), pieces.points[1].size());
  for (const std::uint32_t i : pieces.points[0])
    EXPECT_LT(points.positions[i].norm(), 2);
  EXPECT_EQ(pieces.alone,
            (std::vector<std::uint32_t>{static_cast<std::uint32_t>(objects), static_cast<std::uint32_t>(objects + 1)}));
  std::vector<std::uint32_t> all(pieces.alone);
  for (const auto& piece : pieces.points) {
    EXPECT_TRUE(std::is_sorted(piece.begin(), piece.end()));
    all.insert(all.end(), piece.begin(), piece.end());
  }
  std::sort(all.begin(), all.end());
  ASSERT_EQ(all.size(), points.positions.size());
  for (std::uint32_t i = 0; i < all.size(); ++i)
    ASSERT_EQ(all[i], i);
}

TEST(FindPieces, ThinlySpreadPointsAreNoPieces)
{
  PointSet points;
  for (int x = 0; x < 10; ++x)
    for (int y = 0; y < 10; ++y)
      points.positions.emplace_back(100.f * static_cast<float>(x), 100.f * static_cast<float>(y), 0.f);
  EXPECT_TRUE(findPieces(points.positions, 1).points.empty());
}

TEST(Pieces, AreReconstructedOnTheirOwn)
{
  const std::vector<Eigen::Vector3f> centers = {{-300, 20, 0}, {300, 0, 100}, {0, -4000, 0}};
  const PointSet cloud = spheres(centers);
  const Reconstruction result = clouds::reconstruct(cloud);
  EXPECT_EQ(result.report.points.used, static_cast<std::int64_t>(cloud.size()));
  ASSERT_EQ(result.report.otherPieces.size(), 2u);
  std::int64_t unknowns = result.report.levels.back().unknowns;
  for (const PieceReport& piece : result.report.otherPieces)
    unknowns += piece.levels.back().unknowns;
  // Voxels of .3: cubes of 7 and twice 6 along each side; the box of all has 2,000 × 13,000 × 350.
  EXPECT_LT(unknowns, 3 * 24 * 24 * 24);
  EXPECT_LT(result.field.bytes(), std::size_t{4} << 20);

  EXPECT_EQ(result.report.mesh.components, 3);
  EXPECT_TRUE(result.report.mesh.closed() && result.report.mesh.manifold());
  // Points of spacing .15 on curvature 1, as for a single sphere.
  EXPECT_NEAR(result.report.mesh.volume, 3 * 4 * M_PI / 3, .05 * 4 * M_PI);
  const Eigen::Vector3f offset = result.points.offset.cast<float>();
  for (std::size_t v = 0; v < result.mesh.vertices.size(); ++v) {
    const Eigen::Vector3f position = result.mesh.vertices[v] + offset;
    const auto center = *std::min_element(centers.begin(), centers.end(), [&](const auto& a, const auto& b) {
      return (position - a).norm() < (position - b).norm();
    });
    ASSERT_NEAR((position - center).norm(), 1, .03) << "a tenth of a voxel";
    ASSERT_GT(result.mesh.normals[v].dot(position - center), .95f);
  }
  for (const Eigen::Vector3f& center : centers) {
    EXPECT_LT(result.field.sampleDistance(center - offset), -.5f);
    EXPECT_GT(result.field.sampleDistance(center - offset + Eigen::Vector3f(1.3f, 0, 0)), .1f);
  }
}

TEST(Pieces, PointsAloneAreDroppedAndCounted)
{
  PointSet cloud = spheres({{0, 0, 0}});
  Options options;
  options.outliers.alone = false;
  const std::size_t count = cloud.size();
  cloud.positions.emplace_back(0, 3000, 0);
  cloud.normals.emplace_back(0, 0, 1);
  const Reconstruction result = clouds::reconstruct(cloud, options);
  EXPECT_EQ(result.report.points.alone, 1);
  EXPECT_EQ(result.report.points.used, static_cast<std::int64_t>(count));
  EXPECT_EQ(result.points.size(), count);
  EXPECT_EQ(result.report.mesh.components, 1);
  EXPECT_TRUE(result.report.otherPieces.empty());
}

TEST(Pieces, HolesAsWideAsTheGapKeepThemTogether)
{
  Options options;
  options.trimming.maxHole = 2000;
  options.multiscale.voxelSize = 1;
  EXPECT_TRUE(clouds::reconstruct(spheres({{0, 0, 0}, {600, 0, 0}}), options).report.otherPieces.empty());
}

TEST(Pieces, DoNotDependOnTheNumberOfThreads)
{
  const PointSet cloud = spheres({{-300, 20, 0}, {300, 0, 100}});
  const Reconstruction one = clouds::reconstruct(cloud), four = clouds::reconstruct(cloud, {}, 4);
  EXPECT_EQ(one.mesh.vertices, four.mesh.vertices);
  EXPECT_EQ(one.mesh.triangles, four.mesh.triangles);
}

TEST(Pieces, DoNotWidenTheHolesThatAreFilled)
{
  // Diagonal 4.24: gaps up to 1.02 are filled, and those of a cloud 1,000 wide would be all there are.
  const PointSet sheet =
      shapes::filter(clouds::lattice(61, .05f), [](const Eigen::Vector3f& x) { return x.norm() > .7f; });
  PointSet two = sheet;
  clouds::append(two, sheet, {1000, 0, 0});
  const MeshStatistics alone = clouds::reconstruct(sheet).report.mesh, together = clouds::reconstruct(two).report.mesh;
  EXPECT_EQ(alone.boundaryLoops, 2);
  EXPECT_EQ(together.boundaryLoops, 4);
  // Along rims of 16 each, what is filled at them differs by a fifth of a voxel of .13; the holes are 1.5 each.
  EXPECT_NEAR(together.area, 2 * alone.area, 2 * 16 * .2 * .13);
}
