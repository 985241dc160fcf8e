// SPDX-License-Identifier: BSD-3-Clause
#include "levels/multiscale.h"
#include "support/clouds.h"
#include "support/meshes.h"
#include "support/shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>

using namespace meshes;
using namespace pcl::mrf;

namespace {

/// A run of levels, most of them in bands, that may be solved in tiles.
class TiledRun {
public:
  TiledRun(const PointSet& points, float spacing)
      : points_(shapes::oriented(points)), search_(clouds::searchOf(points)), spacing_(spacing)
  {
    options_.multiscale.denseVoxels = 5000;
  }

  MultiscaleResult solve(int tiles, int threads = 1)
  {
    Execution execution(threads);
    return regularize({&points_, search_.get(), boundingBox(points_.positions)}, spacing_, options_, execution, tiles);
  }

  /// Sets the spacings of the points, as if they were farther apart than they are.
  void setSpacings(std::vector<float> spacings) { points_.spacings = std::move(spacings); }

  void setSteps(int steps) { options_.solver.maxIterations = steps; }

private:
  OrientedPoints points_;
  std::unique_ptr<NeighborSearch> search_;
  float spacing_;
  Options options_;
};

/// Calls body(distance here, distance there), in voxels, near the zero level.
void forNear(const DistanceField& here, const DistanceField& there, const std::function<void(double, double)>& body)
{
  ASSERT_EQ(here.lattice().size, there.lattice().size);
  const double near = 1.5 * here.lattice().spacing;
  shapes::forVoxels(here.lattice().size, [&](int i, int j, int k) {
    if (std::abs(here.distance(i, j, k)) < near)
      body(here.distance(i, j, k) / here.lattice().spacing, there.distance(i, j, k) / here.lattice().spacing);
  });
}

/// Expects the field solved in tiles to be that of the whole level.
void expectSame(const PointSet& points, float spacing, int most = 7, const std::vector<float>& spacings = {})
{
  TiledRun run(points, spacing);
  run.setSpacings(spacings);
  const MultiscaleResult whole = run.solve(1);
  ASSERT_EQ(whole.levels.back().tiles, 1);
  for (const int tiles : {2, most}) {
    const MultiscaleResult tiled = run.solve(tiles);
    const LevelReport& finest = tiled.levels.back();
    EXPECT_EQ(finest.tiles, tiles);
    EXPECT_EQ(finest.unknowns, whole.levels.back().unknowns);
    EXPECT_EQ(finest.observed, whole.levels.back().observed);
    EXPECT_EQ(finest.solve.iterations, whole.levels.back().solve.iterations);
    EXPECT_NEAR(finest.solve.remainingChange, whole.levels.back().solve.remainingChange, .05);
    std::int64_t near = 0;
    double largest = 0;
    forNear(whole.field, tiled.field, [&](double here, double there) {
      ++near;
      largest = std::max(largest, std::abs(here - there));
    });
    EXPECT_GT(near, 10000);
    EXPECT_LT(largest, 1e-3) << tiles << " tiles";
  }
}

} // namespace

TEST(Tiles, AreTheWholeLevel)
{
  expectSame(shapes::sample(shapes::torus(1, .4), 1.6, .016), .016f);
}

TEST(Tiles, MayLeaveSparsePointsToCoarserLevels)
{
  const PointSet points = shapes::sample(shapes::torus(1, .4), 1.6, .02);
  std::vector<float> spacings;
  for (const Eigen::Vector3f& p : points.positions)
    spacings.push_back(p.x() < 0 ? .2f : .02f);
  expectSame(points, .02f, 7, spacings);
}

TEST(Tiles, MayBeNarrowerThanAHole)
{
  // A capsule of which 40 planes show nothing: of some tiles and their halos all.
  const PointSet points = shapes::filter(shapes::sample(shapes::tube({0, 0, -1}, {0, 0, 1}, .5), 1.6, .0125),
                                         [](const Eigen::Vector3f& p) { return std::abs(p.z()) > .5f; });
  const DistanceField field = TiledRun(points, .0125f).solve(1).field;
  ASSERT_LT(field.sampleDistance({.2f, 0, 0}), 0);
  ASSERT_GT(field.sampleDistance({.9f, 0, 0}), 0) << "nothing fills the hole";
  expectSame(points, .0125f, 30);
}

TEST(Tiles, MayHaveASheetAlongACut)
{
  // Sheets across z, one of them in a plane of the lattice.
  PointSet points = shapes::sample(shapes::box({.6, .6, .9}), 1.2, .012);
  for (const float z : {-.5f, -.1f, 0.f, .3f})
    clouds::append(points, clouds::randomSquare(8000, .55f), {0, 0, z});
  expectSame(points, .012f);
}

TEST(Tiles, DecideTogetherWhetherASheetWasMissed)
{
  PointSet points = shapes::sample(shapes::box({.5, .02, 1}), 1.2, .015);
  shapes::addNoise(points, .03);
  TiledRun run(points, .015f);
  ASSERT_GT(run.solve(1).levels.back().solve.iterations, 1) << "nothing was missed";
  expectSame(points, .015f);
}

TEST(Tiles, DoNotDependOnTheNumberOfThreads)
{
  TiledRun run(shapes::sample(shapes::torus(1, .4), 1.6, .016), .016f);
  const MultiscaleResult one = run.solve(3), more = run.solve(3, 3);
  forNear(one.field, more.field, [&](double here, double there) { ASSERT_EQ(here, there); });
}

TEST(Tiles, AreForASingleStep)
{
  TiledRun run(shapes::sample(shapes::torus(1, .4), 1.6, .03), .03f);
  EXPECT_EQ(run.solve(2).levels.back().tiles, 2);
  run.setSteps(2);
  EXPECT_EQ(run.solve(2).levels.back().tiles, 1);
}
