// SPDX-License-Identifier: BSD-3-Clause
// The smoothing length: found with held-out points, or set by known noise.
#include "observation/observation.h"
#include "observation/point_observation.h"
#include "pilot/hold_out.h"
#include "points/sampling_density.h"
#include "support/clouds.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <pcl/surface/mrf/report.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace pcl::mrf;

namespace {

constexpr float spacing = .04f;

SmoothingChoice choose(const PointSet& points, double unit = 1, int threads = 2)
{
  Execution execution(threads);
  const OrientedPoints oriented = shapes::oriented(points);
  const auto search = clouds::searchOf(points);
  return makeHoldOut(oriented, *search, static_cast<float>(unit) * spacing, 2 * unit * spacing, Prior::triharmonic, {},
                     execution)
      ->chooseSmoothing();
}

ResolutionChoice chooseResolution(const OrientedPoints& points, float unit, double smoothing, int threads = 2)
{
  Execution execution(threads);
  const auto search = clouds::searchOf(points);
  return makeHoldOut(points, *search, unit, 2 * static_cast<double>(unit), Prior::triharmonic, {}, execution)
      ->chooseResolution(smoothing, .4f, 0);
}

float chooseGradientWeight(const OrientedPoints& points, double smoothing, double noise)
{
  Execution execution(2);
  const auto search = clouds::searchOf(points);
  return makeHoldOut(points, *search, spacing, 2. * spacing, Prior::triharmonic, {}, execution)
      ->chooseGradientWeight(smoothing, noise);
}

PointSet noisyTorus(double noise)
{
  PointSet points = shapes::sample(shapes::torus(1, .4), 1.6, spacing);
  shapes::addNoise(points, noise);
  return points;
}

} // namespace

TEST(Smoothing, cleanPointsGetTheShortest)
{
  const SmoothingChoice choice = choose(noisyTorus(0));
  EXPECT_EQ(choice.smoothing, shortestSmoothing(spacing));
  EXPECT_EQ(choice.curve.size(), 2u);
  // A torus without details bears the second length as well: what counts is that it is not worth 5 %.
  EXPECT_LT(.95 * choice.curve[0].error, choice.curve[1].error);
  EXPECT_GT(choice.heldOut, 50);
  EXPECT_LT(choice.noise, .05 * spacing);
}

TEST(Smoothing, noiseIsFoundAndSmoothedAway)
{
  double before = shortestSmoothing(spacing);
  for (const double noise : {.25, .5, 1.}) {
    const SmoothingChoice choice = choose(noisyTorus(noise * spacing));
    EXPECT_GT(choice.smoothing, .99 * before) << noise; // the minimum is flat
    before = choice.smoothing;
    // A median of several hundred errors has a deviation of some 6 %; the field's own error adds to the noise.
    EXPECT_NEAR(choice.noise, noise * spacing, .2 * noise * spacing);
    const double rule = smoothingForNoise(noise * spacing, spacing);
    // The rule is for scans with details; a torus has none and bears more.
    EXPECT_GT(choice.smoothing, rule) << noise;
    EXPECT_LT(choice.smoothing, rule * 3) << noise;
  }
}

TEST(Smoothing, strongNoiseIsNotFollowed)
{
  // The score of a short length is better by accident.
  const double noise = 1.4 * spacing;
  const SmoothingChoice choice = choose(noisyTorus(noise));
  EXPECT_GT(choice.smoothing, .8 * smoothingForNoise(noise, spacing));
}

TEST(Smoothing, aLayerOfPointsIsNoise)
{
  // There is a zero level near any of its points if ℓ is short, which the score takes for a small error.
  for (const double noise : {2.5, 4.}) {
    const SmoothingChoice choice = choose(noisyTorus(noise * spacing));
    EXPECT_GT(choice.noise, .65 * noise * spacing) << noise;
    EXPECT_LT(choice.noise, 1.2 * noise * spacing) << noise;
    EXPECT_GT(choice.smoothing, .8 * smoothingForNoise(noise * spacing, spacing)) << noise;
  }
}

/// The neighbors of a point of a thin tube are on all sides of the tube.
TEST(Smoothing, aThinTubeIsNoLayer)
{
  std::mt19937 random(1);
  std::uniform_real_distribution<double> turn(0, 2 * M_PI);
  PointSet points;
  for (int n = 0; n < 1100; ++n) {
    const double along = turn(random), around = turn(random);
    const Eigen::Vector3d outward(std::cos(along), std::sin(along), 0),
        normal = std::cos(around) * outward + std::sin(around) * Eigen::Vector3d::UnitZ();
    points.positions.push_back((2 * outward + .09 * normal).cast<float>());
    points.normals.push_back(normal.cast<float>());
  }
  const SmoothingChoice choice = choose(points);
  EXPECT_LT(choice.smoothing, spacing);
}

TEST(Smoothing, edgesAreNotTakenForNoise)
{
  // Terraces: exact points and normals on steps, which no smooth field meets. Their errors look like noise of a median
  // of their size, but every longer length makes them worse.
  PointSet points;
  for (int i = 0; i < 100; ++i)
    for (int j = 0; j < 100; ++j) {
      const float x = .01f * static_cast<float>(i), y = .01f * static_cast<float>(j);
      const int step = i / 10 % 2 + 2 * (j / 10 % 2);
      clouds::append(points, {x, y, .05f * static_cast<float>(step)}, Eigen::Vector3f::UnitZ());
    }
  const NeighborDistances distances = measureNeighbors(points, *clouds::searchOf(points), serial);
  const float unit = estimateSamplingDensity(points, distances, serial).spacing;
  const SmoothingChoice choice = choose(points, static_cast<double>(unit / spacing));
  ASSERT_FALSE(choice.curve.empty());
  const auto errorAt = [&](double smoothing) {
    const auto closest = std::min_element(choice.curve.begin(), choice.curve.end(), [&](const auto& a, const auto& b) {
      return std::abs(a.smoothing - smoothing) < std::abs(b.smoothing - smoothing);
    });
    return closest->error;
  };
  const auto best = std::min_element(choice.curve.begin(), choice.curve.end(),
                                     [](const auto& a, const auto& b) { return a.error < b.error; });
  // Steps of the search are a factor of √2, and a tenth more error is allowed.
  EXPECT_LE(errorAt(choice.smoothing), 1.15 * best->error);
}

TEST(Resolution, anOversampledSmoothSurfaceGetsLargerVoxels)
{
  constexpr float spacing = .015f;
  const OrientedPoints points = shapes::oriented(shapes::sample(shapes::sphere(1), 1.2, spacing));
  const ResolutionChoice choice = chooseResolution(points, spacing, shortestSmoothing(spacing));
  EXPECT_GT(choice.voxelSize, 1.4 * 2 * spacing);
  EXPECT_GT(choice.curve.size(), 1u);
  EXPECT_FLOAT_EQ(static_cast<float>(choice.curve.front().voxelSize), 2 * spacing);
  // All that was tried is told, in steps of √2, the chosen one among them.
  for (std::size_t n = 1; n < choice.curve.size(); ++n)
    EXPECT_NEAR(choice.curve[n].voxelSize, std::sqrt(2.) * choice.curve[n - 1].voxelSize, 1e-6);
  EXPECT_TRUE(std::any_of(choice.curve.begin(), choice.curve.end(),
                          [&](const ResolutionScore& score) { return score.voxelSize == choice.voxelSize; }));
  // Distances that nobody sees need no comparison with the finest voxels: all 32 cubes are asked about each larger
  // size, but not about the finest one.
  EXPECT_LT(choice.cubes, 32 * static_cast<std::int64_t>(choice.curve.size()));
  EXPECT_GE(choice.cubes, 32);
}

TEST(Resolution, aSmoothSurfaceKeepsFineVoxelsForAnErrorThatIsSeen)
{
  // Below .04 spacings with the next larger voxels, but not below a 50,000th of the diagonal.
  constexpr float spacing = .02f;
  const OrientedPoints points = shapes::oriented(shapes::sample(shapes::sphere(1), 1.2, spacing));
  EXPECT_FLOAT_EQ(static_cast<float>(chooseResolution(points, spacing, shortestSmoothing(spacing)).voxelSize),
                  2 * spacing);
}

TEST(Resolution, detailsKeepTheFinestVoxels)
{
  // A sphere with as fine a relief as the points can carry.
  PointSet sphere = shapes::sample(shapes::sphere(1), 1.2, .04);
  for (std::size_t i = 0; i < sphere.size(); ++i) {
    Eigen::Vector3f& p = sphere.positions[i];
    p *= 1 + .02f * std::sin(30 * p.x()) * std::sin(30 * p.y());
  }
  const ResolutionChoice choice = chooseResolution(shapes::oriented(sphere), .04f, shortestSmoothing(.04));
  EXPECT_FLOAT_EQ(static_cast<float>(choice.voxelSize), .08f);
  // The loss is everywhere: the first dozen of the 32 cubes see it, at two sizes.
  EXPECT_LE(choice.cubes, 2 * 13);
  EXPECT_GE(choice.heldOut, 50);
}

TEST(Resolution, doesNotDependOnTheNumberOfThreads)
{
  const OrientedPoints points = shapes::oriented(noisyTorus(.5 * spacing));
  sameOnAnyThreads([&](int threads) {
    const ResolutionChoice choice = chooseResolution(points, spacing, 1. * spacing, threads);
    std::vector<double> found = {choice.voxelSize};
    for (const ResolutionScore& score : choice.curve)
      found.push_back(score.error);
    return found;
  });
}

TEST(HoldOut, ChoicesAreThoseOfSeparateObjects)
{
  const OrientedPoints points = shapes::oriented(noisyTorus(.5 * spacing));
  Execution execution(2);
  const auto search = clouds::searchOf(points);
  const auto shared = makeHoldOut(points, *search, spacing, 2. * spacing, Prior::triharmonic, {}, execution);
  const SmoothingChoice smoothing = shared->chooseSmoothing();
  const float weight = shared->chooseGradientWeight(smoothing.smoothing, smoothing.noise);
  const ResolutionChoice resolution = shared->chooseResolution(smoothing.smoothing, weight, smoothing.noise);
  EXPECT_EQ(chooseGradientWeight(points, smoothing.smoothing, smoothing.noise), weight);
  const ResolutionChoice own = makeHoldOut(points, *search, spacing, 2. * spacing, Prior::triharmonic, {}, execution)
                                   ->chooseResolution(smoothing.smoothing, weight, smoothing.noise);
  EXPECT_EQ(own.voxelSize, resolution.voxelSize);
  ASSERT_EQ(own.curve.size(), resolution.curve.size());
  // What the solver's tolerance leaves depends on the start.
  for (std::size_t n = 0; n < own.curve.size(); ++n)
    EXPECT_NEAR(own.curve[n].error, resolution.curve[n].error, .01 * own.curve[n].error);
}

TEST(Resolution, fineWavesOnAnEighthOfASheetCount)
{
  // Exact points of a smooth sheet, but for a strip of fine waves on an eighth of it.
  PointSet points;
  for (int i = 0; i < 200; ++i)
    for (int j = 0; j < 200; ++j) {
      const float x = .02f * static_cast<float>(i), y = .02f * static_cast<float>(j);
      const bool isWavy = x > 3.5f;
      const float slope = isWavy ? .03f * 40 * std::cos(40 * (x - 3.5f)) : 0;
      clouds::append(points, {x, y, isWavy ? .03f * std::sin(40 * (x - 3.5f)) : 0},
                     Eigen::Vector3f(-slope, 0, 1).normalized());
    }
  const ResolutionChoice choice = chooseResolution(shapes::oriented(points), .02f, shortestSmoothing(.02));
  // 2 h leaves nothing of waves of 8 spacings, which tell on the mean of all.
  EXPECT_LT(choice.voxelSize, 1.5 * .04);
}

TEST(Resolution, noiseThatLargerVoxelsSmoothDoesNotPayForEdges)
{
  // A plane with fifteen studs of 4 x 4 x 3 spacings, in noise of .2 spacings. All but the studs is better smoothed.
  constexpr float side = .02f;
  constexpr int apart = 80, wide = 4, high = 3;
  PointSet points;
  for (int i = 0; i < 5 * apart; ++i)
    for (int j = 0; j < 200; ++j) {
      const int u = (i + apart / 4) % apart, v = (j + apart / 4) % apart;
      const auto add = [&](int height, const Eigen::Vector3f& normal) {
        clouds::append(points, side * Eigen::Vector3i(i, j, height).cast<float>(), normal);
      };
      const bool isStud = u < wide && v < wide;
      add(isStud ? high : 0, Eigen::Vector3f::UnitZ());
      const bool isSide = isStud && (u == 0 || v == 0 || u == wide - 1 || v == wide - 1);
      const Eigen::Vector3i outward(u == 0 ? -1 : u == wide - 1 ? 1 : 0, v == 0 ? -1 : v == wide - 1 ? 1 : 0, 0);
      for (int height = 1; isSide && height < high; ++height)
        add(height, outward.cast<float>().normalized());
    }
  for (const unsigned seed : {1u, 2u, 3u}) {
    PointSet noisy = points;
    shapes::addNoise(noisy, .2 * side, seed);
    const ResolutionChoice choice = chooseResolution(shapes::oriented(noisy), side, .85 * side);
    EXPECT_LT(choice.voxelSize, 3 * side) << "of seed " << seed;
  }
}

TEST(GradientWeight, exactNormalsCountMoreIfThePointsAreNoisy)
{
  EXPECT_EQ(chooseGradientWeight(shapes::oriented(noisyTorus(0)), .5 * spacing, .05 * spacing), .4f);
  // A curved surface with noise of half a spacing and normals without: what a disc that is left out looks like is in
  // the normals around it.
  PointSet points = shapes::sample(shapes::torus(1, .25), 1.6, spacing);
  shapes::addNoise(points, .5 * spacing);
  EXPECT_EQ(chooseGradientWeight(shapes::oriented(points), 1. * spacing, .5 * spacing), 4.f);
}

TEST(Smoothing, scalesWithTheCloud)
{
  PointSet points = noisyTorus(.5 * spacing), large = points;
  constexpr float unit = 1024; // a power of two: no rounding
  for (Eigen::Vector3f& p : large.positions)
    p *= unit;
  const SmoothingChoice a = choose(points), b = choose(large, unit);
  EXPECT_NEAR(b.smoothing, unit * a.smoothing, 1e-4 * b.smoothing);
  EXPECT_NEAR(b.noise, unit * a.noise, 1e-3 * b.noise);
}

TEST(Smoothing, ofFewPointsAndByTheRulesForNoise)
{
  const SmoothingChoice choice = choose(shapes::sample(shapes::sphere(.2), .3, spacing));
  EXPECT_EQ(choice.smoothing, shortestSmoothing(spacing));
  EXPECT_TRUE(choice.curve.empty());

  EXPECT_EQ(smoothingForNoise(0, 2), shortestSmoothing(2));
  EXPECT_NEAR(smoothingForNoise(2, 2), 2 * 1.5, 1e-12);
  EXPECT_GT(smoothingForNoise(4, 2), smoothingForNoise(2, 2));

  ObservationOptions known;
  known.noise = .2f; // a tenth of the spacing
  EXPECT_NEAR(resolvedSmoothing(known, 2), smoothingForNoise(.2, 2), 1e-6);
  known.noise = 4;
  EXPECT_NEAR(resolvedSmoothing(known, 2), 2 * 1.7 * std::pow(2, .6), 1e-5);
}
