// SPDX-License-Identifier: BSD-3-Clause
#include "field/grid_transfer.h"
#include "field/voxel_set.h"
#include "levels/multiscale.h"
#include "solver/grids.h"
#include "support/clouds.h"
#include "support/meshes.h"
#include "support/shapes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>

using namespace meshes;
using namespace pcl::mrf;

namespace {

using Voxels = std::vector<std::uint8_t>;

const GridSize grid{75, 20, 37}; // two words per row, several pieces of planes

Voxels randomVoxels(unsigned seed, double share)
{
  std::mt19937 random(seed);
  std::bernoulli_distribution isSet(share);
  Voxels voxels(grid.count());
  for (std::uint8_t& voxel : voxels)
    voxel = isSet(random) ? 1 : 0;
  return voxels;
}

bool has(const Voxels& voxels, int x, int y, int z)
{
  return grid.contains(x, y, z) && voxels[grid.index(x, y, z)] != 0;
}

VoxelSet bandOf(const Voxels& voxels, int roundUpTo, int threads = 1)
{
  Execution execution(threads);
  const auto fill = [&](int z, MaskPlane& mask) {
    for (int y = 0; y < grid.y; ++y)
      for (int x = 0; x < grid.x; ++x)
        if (has(voxels, x, y, z))
          mask.set(x, y);
  };
  return VoxelSet(grid, execution, fill, roundUpTo);
}

MultiscaleResult solve(const PointSet& points, float spacing, std::int64_t denseVoxels, const PriorOptions& prior,
                       ObservationKind kind = ObservationKind::points, int threads = 1,
                       const std::function<TriangleMesh(TriangleMesh, float)>& wanted = {})
{
  Execution execution(threads);
  const auto search = clouds::searchOf(points);
  Options options;
  options.observation.kind = kind;
  options.prior = prior;
  options.multiscale.denseVoxels = denseVoxels;
  const OrientedPoints oriented = shapes::oriented(points);
  const auto levels =
      beginLevels({&oriented, search.get(), boundingBox(points.positions)}, spacing, options, execution);
  for (; !levels->done(); levels->solveNext())
    if (wanted && levels->mayLeaveOut())
      levels->refineOnly(wanted(levels->zeroLevel(), levels->voxelSize()));
  return levels->result();
}

/// The levels of points with spacings of their own.
MultiscaleResult solve(const OrientedPoints& points, float spacing, std::int64_t denseVoxels, float smoothing = 0)
{
  Execution execution(2);
  const auto search = clouds::searchOf(points);
  Options options;
  options.observation.smoothing = smoothing;
  options.multiscale.denseVoxels = denseVoxels;
  return regularize({&points, search.get(), boundingBox(points.positions)}, spacing, options, execution);
}

constexpr std::int64_t everything = std::numeric_limits<std::int64_t>::max(), fewVoxels = 5000;

} // namespace

TEST(VoxelSet, HoldsTheVoxelsThatWereSet)
{
  for (const double share : {.02, .5, 1.}) {
    const Voxels voxels = randomVoxels(1, share);
    const VoxelSet band = bandOf(voxels, 0);
    std::int64_t next = 0; // packed values follow each other in memory order
    shapes::forVoxels(grid, [&](int x, int y, int z) {
      const std::int64_t at = band.find(x, y, z);
      ASSERT_EQ(at >= 0, has(voxels, x, y, z));
      if (at >= 0) {
        ASSERT_EQ(at, next++);
      }
    });
    EXPECT_EQ(band.count(), next);
    EXPECT_FALSE(band.contains(-1, 0, 0));
    EXPECT_FALSE(band.contains(0, 0, grid.z));
  }
}

TEST(VoxelSet, LengthensRunsToWholeVectorsUpToALimit)
{
  const int limit = grid.x - 3;
  Voxels voxels = randomVoxels(2, .05);
  shapes::forVoxels(grid, [&](int x, int y, int z) {
    if (x >= limit)
      voxels[grid.index(x, y, z)] = 0;
  });
  const VoxelSet exact = bandOf(voxels, 0), rounded = bandOf(voxels, limit);
  EXPECT_GT(rounded.count(), exact.count());
  shapes::forVoxels(grid, [&](int x, int y, int z) {
    if (has(voxels, x, y, z)) {
      ASSERT_TRUE(rounded.contains(x, y, z));
    }
    if (x >= limit) {
      ASSERT_FALSE(rounded.contains(x, y, z));
    }
  });
  for (int z = 0; z < grid.z; ++z)
    rounded.forRuns(
        z, [&](const pcl::mrf::Run& run, int x, int) { EXPECT_TRUE(run.count % 8 == 0 || x + run.count == limit); });
}

TEST(MaskPlane, GrowsByTheStepsItIsTold)
{
  std::mt19937 random(6);
  const GridSize size{150, 40, 1}; // three words per row, the last one not full
  MaskPlane some(size);
  for (int n = 0; n < 12; ++n)
    some.set(static_cast<int>(random() % 150), static_cast<int>(random() % 40));
  const auto hasAround = [&](int x, int y, int lowerX, int upperX, int lowerY, int upperY) {
    for (int j = std::max(y + lowerY, 0); j <= std::min(y + upperY, size.y - 1); ++j)
      for (int i = std::max(x + lowerX, 0); i <= std::min(x + upperX, size.x - 1); ++i)
        if (some.has(i, j))
          return true;
    return false;
  };
  for (const int steps : {0, 1, 2, 3, 4, 5, 11, 30, 70, 100}) { // beyond 64, shifts are of less than their full stride
    MaskPlane alongX = some, alongY = some;
    alongX.growAlongX(steps);
    alongY.growAlongY(steps);
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < 192; ++x) { // up to the end of the last word
        ASSERT_EQ(alongX.has(x, y), x < size.x && hasAround(x, y, -steps, steps, 0, 0)) << steps;
        ASSERT_EQ(alongY.has(x, y), x < size.x && hasAround(x, y, 0, 0, -steps, steps)) << steps;
      }
  }
  MaskPlane cells = some;
  cells.growUpwards();
  for (int y = 0; y < size.y; ++y)
    for (int x = 0; x < 192; ++x)
      ASSERT_EQ(cells.has(x, y), x < size.x && hasAround(x, y, -1, 0, -1, 0));
}

TEST(VoxelSet, GrowsAndShrinksLikeItsVoxels)
{
  Execution execution(2);
  const Voxels sparse = randomVoxels(3, .003), full = randomVoxels(4, .98);
  const VoxelSet grown = dilated(bandOf(sparse, 0), 2, 3, execution), shrunk = eroded(bandOf(full, 0), 2, execution);
  shapes::forVoxels(grid, [&](int x, int y, int z) {
    bool isNear = false, isInside = true;
    for (int dz = -2; dz <= 2; ++dz)
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -3; dx <= 3; ++dx) {
          isNear = isNear || has(sparse, x + dx, y + dy, z + dz);
          if (std::abs(dx) + std::abs(dy) + std::abs(dz) <= 2)
            isInside = isInside && has(full, x + dx, y + dy, z + dz);
        }
    ASSERT_EQ(grown.contains(x, y, z), isNear);
    ASSERT_EQ(shrunk.contains(x, y, z), isInside);
  });
}

TEST(VoxelSet, KnowsItsPlanes)
{
  // Planes 3 to 8, of which 4 to 6 and 7 to 8 are alike.
  Execution execution(2);
  const VoxelSet band(grid, execution, [&](int z, MaskPlane& mask) {
    if (z >= 3 && z <= 8)
      mask.setRange(z == 3 ? 1 : 2, z < 7 ? 30 : 31, 5);
  });
  EXPECT_EQ(band.bottom(), 3);
  EXPECT_EQ(band.top(), 9);
  EXPECT_TRUE(band.areAlike(4, 6));
  EXPECT_TRUE(band.areAlike(8, 7));
  EXPECT_FALSE(band.areAlike(3, 4));
  EXPECT_FALSE(band.areAlike(6, 7));
  EXPECT_FALSE(band.areAlike(4, grid.z));
  EXPECT_FALSE(band.areAlike(-1, 4));
  const VoxelSet none(grid, execution, [](int, MaskPlane&) {});
  EXPECT_EQ(none.bottom(), none.top());
}

TEST(VoxelSet, CountsNeighborsAndFollowsThem)
{
  Execution execution(2);
  const Voxels voxels = randomVoxels(5, .2);
  const VoxelSet band = bandOf(voxels, 0);
  const PackedValues counts = degrees(band, execution);
  Voxels seeds(voxels.size(), 0);
  seeds[grid.index(40, 10, 8)] = 1;
  Voxels start = voxels;
  start[grid.index(40, 10, 8)] = 1;
  const VoxelSet reached = connectedTo(bandOf(start, 0), bandOf(seeds, 0), execution);

  // Flooding, voxel by voxel.
  Voxels flooded = seeds;
  for (bool grows = true; grows;) {
    grows = false;
    shapes::forVoxels(grid, [&](int x, int y, int z) {
      if (has(flooded, x, y, z) || !has(start, x, y, z))
        return;
      if (has(flooded, x - 1, y, z) || has(flooded, x + 1, y, z) || has(flooded, x, y - 1, z) ||
          has(flooded, x, y + 1, z) || has(flooded, x, y, z - 1) || has(flooded, x, y, z + 1)) {
        flooded[grid.index(x, y, z)] = 1;
        grows = true;
      }
    });
  }
  shapes::forVoxels(grid, [&](int x, int y, int z) {
    ASSERT_EQ(reached.contains(x, y, z), has(flooded, x, y, z));
    if (const std::int64_t at = band.find(x, y, z); at >= 0) {
      ASSERT_EQ(counts[at], has(voxels, x - 1, y, z) + has(voxels, x + 1, y, z) + has(voxels, x, y - 1, z) +
                                has(voxels, x, y + 1, z) + has(voxels, x, y, z - 1) + has(voxels, x, y, z + 1));
    }
  });
}

class BandedLevels : public testing::TestWithParam<std::tuple<ObservationKind, Prior>> {};

TEST_P(BandedLevels, AgreeWithDenseOnes)
{
  const auto [kind, order] = GetParam();
  const PointSet points = shapes::sample(shapes::torus(1, .4), 1.6, .04);
  PriorOptions prior;
  prior.kind = order;
  const MultiscaleResult dense = solve(points, .04f, everything, prior, kind),
                         banded = solve(points, .04f, fewVoxels, prior, kind);
  ASSERT_EQ(dense.field.lattice().size, banded.field.lattice().size);
  ASSERT_LT(banded.levels.back().unknowns, dense.levels.back().unknowns / 2);
  EXPECT_LT(banded.field.bytes(), dense.field.bytes());
  const std::vector<double> there = zeroLevelOffsets(banded.field, dense.field),
                            back = zeroLevelOffsets(dense.field, banded.field);
  // Where there are points everywhere; a hundredth of a voxel is less than what points half a voxel apart tell.
  // The membrane's field, flat off the data, is held at the band's rim: measured .034.
  const double limit = order == Prior::membrane ? .035 : .01;
  EXPECT_LT(rootMeanSquare(there), limit);
  EXPECT_LT(rootMeanSquare(back), limit);
  EXPECT_LT(*std::max_element(there.begin(), there.end()), .15);
  EXPECT_LT(*std::max_element(back.begin(), back.end()), .15);
  // Away from the band the sign is what counts.
  EXPECT_GT(banded.field.sampleDistance(Eigen::Vector3f::Zero()), 0);
  EXPECT_LT(banded.field.sampleDistance({1, 0, 0}), 0);
  EXPECT_EQ(banded.field.hasConfidences(), kind != ObservationKind::points);
}

INSTANTIATE_TEST_SUITE_P(EveryModel, BandedLevels,
                         testing::Combine(testing::Values(ObservationKind::points, ObservationKind::plane),
                                          testing::Values(Prior::membrane, Prior::thinPlate, Prior::triharmonic)));

TEST(BandedLevels, GradientsAreThoseOfTheVoxelsAround)
{
  const PointSet points = shapes::sample(shapes::torus(1, .4), 1.6, .04);
  const DistanceField field = solve(points, .04f, fewVoxels, {}).field;
  const Lattice& lattice = field.lattice();
  const GridSize size = lattice.size;
  // The same values, looked up one by one and stored everywhere.
  std::vector<float> distances;
  for (std::int64_t n = 0; n < size.count(); ++n) {
    const Eigen::Array3i voxel = size.voxel(n);
    distances.push_back(field.distance(voxel.x(), voxel.y(), voxel.z()));
  }
  const DistanceField plain(lattice, distances, {});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  int stored = 0, border = 0, elsewhere = 0;
  for (int n = 0; n < 20000; ++n) {
    const Eigen::Vector3d share(uniform(random), uniform(random), uniform(random));
    const Eigen::Vector3d voxel = share.cwiseProduct(Eigen::Vector3d(size.x - 1, size.y - 1, size.z - 1));
    const auto position = Eigen::Vector3f((lattice.origin + lattice.spacing * voxel).cast<float>());
    const Eigen::Vector3d inLattice = lattice.toVoxels(position);
    const Eigen::Array3i cell =
        inLattice.array().floor().cast<int>().max(0).min(Eigen::Array3i(size.x - 2, size.y - 2, size.z - 2));
    const Eigen::Vector3f expected = plain.sampleGradient(position);
    ASSERT_LT((field.sampleGradient(position) - expected).norm(), 1e-3f * (1 + expected.norm()));
    const bool isAtBorder =
        (cell == 0).any() || cell.x() == size.x - 2 || cell.y() == size.y - 2 || cell.z() == size.z - 2;
    ++(isAtBorder ? border : field.hasCell(cell.x(), cell.y(), cell.z()) ? stored : elsewhere);
  }
  EXPECT_GT(std::min({stored, border, elsewhere}), 500);
}

TEST(BandedLevels, LieInTheAxesOfTheCloudHoweverTheyAreStored)
{
  // Three different sides: whatever the order, they are stored in the same one, half of the times mirrored.
  const shapes::Sdf brick = shapes::box({.9, .4, 2}, .3);
  bool wereMirrored = false, wereNot = false;
  for (const std::array<int, 3>& axes : {std::array<int, 3>{0, 1, 2}, {1, 0, 2}, {2, 1, 0}, {1, 2, 0}}) {
    const auto turned = [&](const Eigen::Vector3d& p) {
      Eigen::Vector3d natural;
      for (std::size_t a = 0; a < 3; ++a)
        natural[static_cast<Eigen::Index>(a)] = p[axes[a]];
      return natural;
    };
    const PointSet points = shapes::sample([&](const Eigen::Vector3d& p) { return brick(turned(p)); }, 2.5, .05);
    for (const ObservationKind kind : {ObservationKind::points, ObservationKind::plane}) {
      const MultiscaleResult result = solve(points, .05f, fewVoxels, {}, kind);
      const DistanceField& field = result.field;
      (field.axes().isMirrored() ? wereMirrored : wereNot) = true;
      const BoundingBox box = boundingBox(points.positions);
      const GridSize size = field.lattice().size;
      EXPECT_EQ(result.levels.back().size, size);
      // Voxels of .1 and padding of six.
      EXPECT_NEAR(size.x, (box.upper - box.lower).x() / .1 + 12, 2);
      EXPECT_NEAR(size.y, (box.upper - box.lower).y() / .1 + 12, 2);
      EXPECT_NEAR(size.z, (box.upper - box.lower).z() / .1 + 12, 2);
      EXPECT_LT(field.sampleDistance(Eigen::Vector3f::Zero()), -.1f);
      for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_NEAR(field.sampleDistance(points.positions[i]), 0, .02) << "a fifth of a voxel";
        ASSERT_GT(field.sampleGradient(points.positions[i]).normalized().dot(points.normals[i]), .9f);
      }
      const MeshStatistics statistics = measure(zeroLevel(field));
      EXPECT_TRUE(statistics.closed() && statistics.manifold());
      const double volume = measure(zeroLevel(solve(points, .05f, everything, {}, kind).field)).volume;
      EXPECT_NEAR(statistics.volume, volume, .001 * volume) << "outward, and that of dense levels";
      // Rows of signs say the same as voxels.
      std::vector<std::uint64_t> words(static_cast<std::size_t>(size.x + 63) / 64);
      for (int k = 0; k < size.z; ++k)
        for (int j = 0; j < size.y; ++j) {
          field.signsOfRow(j, k, words.data());
          for (int i = 0; i + 1 < size.x; ++i)
            if (field.hasCell(i, j, k)) {
              ASSERT_EQ(words[static_cast<std::size_t>(i) / 64] >> (i % 64) & 1, field.distance(i, j, k) < 0 ? 1u : 0u);
            }
        }
    }
  }
  EXPECT_TRUE(wereMirrored && wereNot);
}

TEST(BandedLevels, LeaveOutWhatIsNotWanted)
{
  // Bricks without their middles, which the field fills; stored in another order of axes, mirrored and not.
  constexpr float spacing = .025f;
  bool wereMirrored = false, wereNot = false;
  for (const Eigen::Vector3d& half : {Eigen::Vector3d(.35, .8, 1.8), Eigen::Vector3d(.8, .35, 1.8)}) {
    const shapes::Sdf brick = shapes::box(half, .3);
    const PointSet points =
        shapes::filter(shapes::sample(brick, 2, spacing), [](const Eigen::Vector3f& p) { return std::abs(p.z()) > 1; });
    const auto isMiddle = [](const Eigen::Vector3f& p) { return std::abs(p.z()) < .9f; };
    int asked = 0;
    const auto dropMiddle = [&](TriangleMesh mesh, float voxelSize) {
      ++asked;
      EXPECT_GT(voxelSize, 3 * spacing) << "the finest level's mesh is not asked about";
      for (const Eigen::Vector3f& vertex : mesh.vertices)
        if (std::abs(vertex.z()) > 1) {
          EXPECT_NEAR(brick(vertex.cast<double>()), 0, .5 * voxelSize) << "in the axes of the cloud";
        }
      return selectWhere(mesh, [&](const Eigen::Vector3f& p) { return !isMiddle(p); });
    };
    const MultiscaleResult whole = solve(points, spacing, fewVoxels, {}),
                           part = solve(points, spacing, fewVoxels, {}, ObservationKind::points, 2, dropMiddle);
    (part.field.axes().isMirrored() ? wereMirrored : wereNot) = true;
    EXPECT_GE(asked, 1);
    EXPECT_LT(static_cast<double>(part.levels.back().unknowns), .9 * static_cast<double>(whole.levels.back().unknowns));
    // Four voxels of the coarser level and some beside what is wanted are left.
    const auto innermost = [&](const DistanceField& field) {
      float result = std::numeric_limits<float>::max();
      for (const Eigen::Vector3f& vertex : zeroLevel(field).vertices)
        result = std::min(result, std::abs(vertex.z()));
      return result;
    };
    EXPECT_LT(innermost(whole.field), .05f);
    EXPECT_GT(innermost(part.field), .1f);
    // What is wanted is what it was.
    std::vector<double> moved;
    for (const Eigen::Vector3f& vertex : zeroLevel(part.field).vertices)
      if (!isMiddle(vertex))
        moved.push_back(whole.field.sampleDistance(vertex) / (2 * spacing));
    EXPECT_GT(moved.size(), 2000u);
    EXPECT_LT(rootMeanSquare(moved), .01);
  }
  EXPECT_TRUE(wereMirrored && wereNot);
}

/// Points of two densities. \param spacing that is given to the levels
OrientedPoints joined(const PointSet& dense, float spacing, const PointSet& sparse, float sparseSpacing)
{
  OrientedPoints points = shapes::oriented(dense);
  points.spacings.assign(points.size(), spacing);
  const OrientedPoints others = shapes::oriented(sparse);
  points.positions.insert(points.positions.end(), others.positions.begin(), others.positions.end());
  points.normals.insert(points.normals.end(), others.normals.begin(), others.normals.end());
  points.confidences.insert(points.confidences.end(), others.confidences.begin(), others.confidences.end());
  points.spacings.resize(points.positions.size(), sparseSpacing);
  return points;
}

/// A torus with points of spacing .02 beyond an x, and sparser by a factor elsewhere.
OrientedPoints pointsOfTwoDensities(float from, float factor)
{
  const float spacing = .02f;
  const shapes::Sdf torus = shapes::torus(1, .4);
  const PointSet dense = shapes::sample(torus, 1.6, spacing), sparse = shapes::sample(torus, 1.6, factor * spacing);
  return joined(shapes::filter(dense, [&](const auto& p) { return p.x() >= from; }), spacing,
                shapes::filter(sparse, [&](const auto& p) { return p.x() < from; }), factor * spacing);
}

TEST(BandedLevels, LeaveSparsePointsToCoarserLevels)
{
  const double spacing = .02;
  const shapes::Sdf torus = shapes::torus(1, .4);
  OrientedPoints points = pointsOfTwoDensities(.6f, 6);
  const MultiscaleResult part = solve(points, static_cast<float>(spacing), fewVoxels);
  ASSERT_NE(part.field.coarserBand(), nullptr);
  points.spacings.assign(points.size(), static_cast<float>(spacing));
  const MultiscaleResult whole = solve(points, static_cast<float>(spacing), fewVoxels);
  EXPECT_EQ(whole.field.coarserBand(), nullptr);
  EXPECT_LT(static_cast<double>(part.levels.back().unknowns), .8 * static_cast<double>(whole.levels.back().unknowns));
  const TriangleMesh mesh = zeroLevel(part.field);
  const MeshStatistics statistics = measure(mesh);
  EXPECT_EQ(statistics.boundaryEdges, 0);
  EXPECT_EQ(statistics.components, 1);
  EXPECT_EQ(statistics.eulerCharacteristic, 0);
  std::vector<double> nearDense, nearSparse;
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    (vertex.x() > .8f ? nearDense : nearSparse).push_back(torus(vertex.cast<double>()) / spacing);
  EXPECT_LT(rootMeanSquare(nearDense), .02);
  EXPECT_LT(rootMeanSquare(nearSparse), .3);
}

TEST(BandedLevels, NormalsDoNotLeadUnderStrongNoise)
{
  const float spacing = .02f;
  const shapes::Sdf torus = shapes::torus(1, .4);
  OrientedPoints points = shapes::oriented(shapes::sample(torus, 1.6, spacing));
  std::mt19937 random(1);
  std::normal_distribution<float> noise;
  for (std::size_t i = 0; i < points.size(); ++i) {
    points.positions[i] += 1.2f * spacing * noise(random) * points.normals[i];
    const Eigen::Vector3f tilt(noise(random), noise(random), noise(random));
    points.normals[i] = (points.normals[i] + tilt).normalized();
  }
  const auto error = [&](float deviation) {
    points.typicalDeviation = deviation;
    std::vector<double> distances;
    for (const Eigen::Vector3f& vertex : zeroLevel(solve(points, spacing, fewVoxels, 2 * spacing).field).vertices)
      distances.push_back(torus(vertex.cast<double>()) / static_cast<double>(spacing));
    return rootMeanSquare(distances);
  };
  EXPECT_LT(error(1.2f * spacing), .9 * error(.9f * spacing));
}

TEST(BandedLevels, MoveTheFieldAVoxelOfTheCoarserAtMost)
{
  // Where dense points end, the next ones are thirty voxels away.
  const MultiscaleResult result = solve(pointsOfTwoDensities(.3f, 12), .008f, 1 << 18);
  ASSERT_NE(result.field.coarserBand(), nullptr);
  const MeshStatistics mesh = measure(zeroLevel(result.field));
  EXPECT_EQ(mesh.boundaryEdges, 0);
  EXPECT_EQ(mesh.eulerCharacteristic, 0);
}

TEST(BandedLevels, KeepASparseSheetBesideDensePointsOfAnother)
{
  // Close to the small sphere the large one is not left out, and has no points there.
  const PointSet large = shapes::sample(shapes::sphere(1), 1.1, .065);
  for (const float gap : {.06f, .08f, .14f}) {
    PointSet small = shapes::sample(shapes::sphere(.03), .04, .0015);
    for (Eigen::Vector3f& p : small.positions)
      p.x() += 1.03f + gap;
    const MultiscaleResult result = solve(joined(small, .0015f, large, .065f), .003f, 1 << 18);
    ASSERT_NE(result.field.coarserBand(), nullptr);
    const MeshStatistics mesh = measure(zeroLevel(result.field));
    EXPECT_EQ(mesh.boundaryEdges, 0) << gap;
    EXPECT_EQ(mesh.eulerCharacteristic, 4) << gap;
  }
}

TEST(BandedLevels, MayLeaveAllButAFewPointsOrAll)
{
  OrientedPoints points = shapes::oriented(shapes::sample(shapes::torus(1, .4), 1.6, .02));
  for (const std::size_t dense : {0, 1, 30}) {
    points.spacings.assign(points.size(), 1);
    std::fill_n(points.spacings.begin(), dense, .02f);
    const MeshStatistics mesh = measure(zeroLevel(solve(points, .02f, fewVoxels).field));
    EXPECT_EQ(mesh.boundaryEdges, 0) << dense;
    EXPECT_EQ(mesh.eulerCharacteristic, 0) << dense;
  }
}

TEST(BandedLevels, KeepThinPlatesAndNestedShells)
{
  // On the last dense level the plate is half a voxel thick, and the gap between the shells is one voxel wide.
  const shapes::Sdf plate = shapes::box({1, .8, .09});
  const auto shells = [](const Eigen::Vector3d& x) {
    const double r = x.norm();
    return std::max({r - 1, .75 - r}) < 0 ? std::max(r - 1, .75 - r) : std::min(std::abs(r - 1), std::abs(r - .75));
  };
  for (const bool isPlate : {true, false}) {
    const PointSet points = isPlate ? shapes::sample(plate, 1.2, .03) : shapes::sample(shells, 1.2, .03);
    const DistanceField field = solve(points, .03f, fewVoxels, {}).field;
    const TriangleMesh mesh = zeroLevel(field);
    std::int64_t off = 0;
    for (const Eigen::Vector3f& vertex : mesh.vertices) {
      const Eigen::Vector3d x = vertex.cast<double>();
      const double distance = std::abs(isPlate ? plate(x) : shells(x));
      // Around a thing that thin the field changes sign again, at four spacings and more: that is trimmed.
      off += distance > .03 && distance < .1;
    }
    // Half a voxel; the plate's edges are rounded off, and grids of twice the thickness leave a few vertices there.
    EXPECT_LT(static_cast<double>(off), .035 * static_cast<double>(mesh.vertices.size())) << isPlate;
    std::vector<double> missing;
    for (const Eigen::Vector3f& point : points.positions)
      missing.push_back(std::abs(field.sampleDistance(point)) / field.lattice().spacing);
    EXPECT_LT(rootMeanSquare(missing), .1)
        << isPlate; // creases are rounded; a face that is missing would be half a voxel off or more
  }
}

TEST(BandedLevels, DoNotDependOnTheNumberOfThreads)
{
  const PointSet points = shapes::sample(shapes::torus(1, .4), 1.6, .0155);
  const MultiscaleResult result = solve(points, .0155f, fewVoxels, {}, ObservationKind::points, 1);
  ASSERT_GT(result.levels.back().unknowns, 100000) << "too few for slabs of their own";
  const DistanceField& one = result.field;
  const GridSize size = one.lattice().size;
  for (const int threads : {3, 40}) { // 40: more than there are slabs of a useful thickness
    const DistanceField more = solve(points, .0155f, fewVoxels, {}, ObservationKind::points, threads).field;
    for (int k = 0; k < size.z; ++k)
      for (int j = 0; j < size.y; ++j)
        for (int i = 0; i < size.x; i += 3)
          ASSERT_EQ(one.distance(i, j, k), more.distance(i, j, k)) << threads << " threads";
  }
}
