// SPDX-License-Identifier: BSD-3-Clause
#include "pilot/volume.h"

// The room that the volume of the field has beside openings.
#include "support/clouds.h"
#include "support/shapes.h"

#include <pcl/surface/mrf/reconstruction.h>

#include <Eigen/Geometry>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

using namespace pcl::mrf;

namespace {

constexpr float spacing = .05f, unlimited = std::numeric_limits<float>::infinity();

PointSet turned(PointSet points, const Eigen::Quaternionf& rotation)
{
  for (Eigen::Vector3f& position : points.positions)
    position = rotation * position;
  for (Eigen::Vector3f& normal : points.normals)
    normal = rotation * normal;
  return points;
}

/// A dish 2 wide and .27 deep with a hole of radius .4 in its middle, and the points removed from the hole.
struct Dish {
  PointSet points, hole;

  explicit Dish(const Eigen::Quaternionf& rotation)
  {
    const PointSet all = shapes::filter(shapes::sample(shapes::sphere(2), 2.1, spacing),
                                        [](const Eigen::Vector3f& p) { return p.z() > std::sqrt(3.f); });
    const auto isInHole = [](const Eigen::Vector3f& p) { return p.head<2>().norm() < .4f; };
    points = turned(shapes::filter(all, [&](const Eigen::Vector3f& p) { return !isInHole(p); }), rotation);
    hole = turned(shapes::filter(all, isInHole), rotation);
  }
};

const std::vector<Eigen::Quaternionf>& rotations()
{
  using Turn = Eigen::AngleAxisf;
  static const std::vector<Eigen::Quaternionf> result = {
      Eigen::Quaternionf::Identity(), Eigen::Quaternionf(Turn(float(M_PI) / 4, Eigen::Vector3f::UnitX())),
      Eigen::Quaternionf(Turn(float(M_PI) / 2, Eigen::Vector3f::UnitY())),
      Eigen::Quaternionf(Turn(float(M_PI) / 4, Eigen::Vector3f(1, 1, 0).normalized()))};
  return result;
}

BoundingBox volumeOf(const PointSet& points, float maxHole)
{
  Execution execution(1);
  const auto search = clouds::searchOf(points);
  Options options;
  options.multiscale.voxelSize = 2 * spacing;
  return chooseVolume(shapes::oriented(points), *search, spacing, options, maxHole, execution);
}

Eigen::Array3f growth(const PointSet& points, float maxHole)
{
  const BoundingBox box = boundingBox(points.positions), volume = volumeOf(points, maxHole);
  EXPECT_TRUE((volume.lower.array() <= box.lower.array()).all() && (volume.upper.array() >= box.upper.array()).all());
  return ((box.lower - volume.lower).array()).max((volume.upper - box.upper).array());
}

/// Options with voxels of two spacings; the automatic voxels of such a smooth shape are larger.
Options fixedVoxels()
{
  Options options;
  options.multiscale.voxelSize = 2 * spacing;
  return options;
}

} // namespace

TEST(Volume, FlatSurfacesGetRoomForTheirHolesAndClosedOnesNone)
{
  PointSet points;
  for (int x = -40; x <= 40; ++x)
    for (int y = -40; y <= 40; ++y)
      if (const Eigen::Vector3f p(spacing * static_cast<float>(x), spacing * static_cast<float>(y), 0);
          p.norm() > .8f) {
        points.positions.push_back(p);
        points.normals.push_back(Eigen::Vector3f::UnitZ());
      }
  // The hole's middle is .8 from the nearest points: a ball of 1.2 times that; the coarse grid sees it to a voxel of
  // .2.
  const float room = growth(points, unlimited).z();
  EXPECT_GT(room, .8f);
  EXPECT_LT(room, 1.2f);
  // Holes that are not to be filled need none, but for the strip at rims: 2 voxels of the coarse grid.
  EXPECT_LT(growth(points, 1).z(), 1.2f * 2 * .2f + .01f);
  EXPECT_LT(growth(points, 1).maxCoeff(), 1.2f * 4 * .2f);
  EXPECT_LT(growth(shapes::sample(shapes::torus(1, .4), 1.6, spacing), unlimited).maxCoeff(), 1e-6f);
}

TEST(Volume, CorridorsTakeWhatTheirSurfaceTakes)
{
  // Open at both ends and 100 times as long as wide: the coarse grid cannot see that it is a tube.
  PointSet points;
  for (int ring = 0; ring < 1200; ++ring)
    for (int n = 0; n < 38; ++n) {
      const float angle = static_cast<float>(2 * M_PI) / 38 * (static_cast<float>(n) + (ring % 2 == 0 ? .5f : 0));
      points.normals.emplace_back(0, std::cos(angle), std::sin(angle));
      points.positions.push_back(.3f * points.normals.back() +
                                 Eigen::Vector3f(spacing * static_cast<float>(ring), 0, 0));
    }
  EXPECT_LE(growth(points, 30).maxCoeff(), 20 * 2 * spacing + 1e-3f);
  Options options = fixedVoxels();
  options.multiscale.denseVoxels = 1 << 18; // two million would be solved everywhere, and tell nothing
  const Reconstruction result = clouds::reconstruct(points, options);
  EXPECT_EQ(result.report.mesh.components, 1);
  // The tube, ten voxels per face of .1; what goes on behind its ends is a strip.
  EXPECT_LT(static_cast<double>(result.report.levels.back().unknowns), 1.5 * 10 * 60 * 2 * M_PI * .3 / .01);
}

TEST(Volume, DoesNotDependOnHowADishLiesInItsBox)
{
  std::vector<double> errors, unknowns;
  Options options = fixedVoxels();
  options.observation.smoothing = .6f * spacing; // left to the data, so smooth a shape's would turn on a hair
  for (const Eigen::Quaternionf& rotation : rotations()) {
    const Dish dish(rotation);
    const Reconstruction result = clouds::reconstruct(dish.points, options);
    EXPECT_GE(result.report.trimming.holesFilled, 1);
    unknowns.push_back(static_cast<double>(result.report.levels.back().unknowns));
    std::vector<double> offsets;
    for (const Eigen::Vector3f& p : dish.hole.positions) {
      const Eigen::Vector3f at = p - result.points.offset.cast<float>();
      offsets.push_back(static_cast<double>(result.field.sampleDistance(at)) / result.field.lattice().spacing);
    }
    errors.push_back(rootMeanSquare(offsets));
  }
  // In voxels; the hole is 8 of them wide, its cap .4 high. The lattice's own directions make half a hundredth; with
  // the volume's border close above and beneath it is two.
  for (const double error : errors) {
    EXPECT_LT(error, .015);
    EXPECT_NEAR(error, errors.front(), .01);
  }
  for (const double count : unknowns)
    EXPECT_LT(count, 3 * unknowns.front()) << "the box of a tilted dish holds more of the sheet around it";
}

TEST(Volume, WhatWillBeDroppedIsNotSolved)
{
  // With so wide a padding the sheet around the dish is most of the surface.
  const Dish dish(Eigen::Quaternionf::Identity());
  Options options = fixedVoxels();
  options.multiscale.padding = 30;
  const Reconstruction everywhere = clouds::reconstruct(dish.points, options);
  options.multiscale.denseVoxels = 20000;
  const Reconstruction trimmed = clouds::reconstruct(dish.points, options);
  options.trimming.kind = Trimming::none;
  const Reconstruction whole = clouds::reconstruct(dish.points, options);
  // What is far from the points is left to coarser levels in both.
  EXPECT_LT(static_cast<double>(trimmed.report.levels.back().unknowns),
            .95 * static_cast<double>(whole.report.levels.back().unknowns));
  EXPECT_LT(trimmed.report.trimming.areaDropped, .5 * everywhere.report.trimming.areaDropped);
  // What is kept is the same: the surface to .06 voxels, and the rim to less than half of its 75 voxels.
  for (const Eigen::Vector3f& vertex : trimmed.mesh.vertices)
    ASSERT_NEAR(everywhere.field.sampleDistance(vertex), 0, .06 * 2 * spacing);
  EXPECT_NEAR(trimmed.report.mesh.area, everywhere.report.mesh.area, 35 * .01);
  EXPECT_EQ(trimmed.report.mesh.components, 1);
}
