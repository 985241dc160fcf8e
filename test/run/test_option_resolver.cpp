// SPDX-License-Identifier: BSD-3-Clause
// Requested and resolved options: which values a run replaces, which it keeps, and that no step can be forgotten.
#include "levels/multiscale.h"
#include "observation/observation.h"
#include "run/option_resolver.h"
#include "support/clouds.h"
#include "support/threads.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <type_traits>

using namespace pcl::mrf;

namespace {

SamplingDensity densityOf(float spacing)
{
  SamplingDensity density;
  density.spacing = spacing;
  density.nearestMean = spacing;
  density.nearestDeviation = .1f * spacing;
  density.eighthMedian = 2 * spacing;
  return density;
}

/// Options that leave nothing to cross-validation.
Options givenOptions()
{
  Options options;
  options.observation.noise = .01f;
  options.multiscale.quality = Quality::draft;
  return options;
}

ResolvedOptions resolve(const Options& requested, float spacing, float diagonal)
{
  Report report;
  OptionResolver resolver(requested, densityOf(spacing));
  resolver.chooseByData({}, *makePointBins(), report, serial);
  resolver.limitTrimming(diagonal);
  return resolver.resolved();
}

} // namespace

static_assert(!std::is_constructible_v<ResolvedOptions, Options> && !std::is_convertible_v<Options, ResolvedOptions> &&
                  !std::is_default_constructible_v<ResolvedOptions>,
              "a request does not pass for resolved options");

TEST(OptionResolver, derivesLengthsFromTheDensityAndTheExtent)
{
  const ResolvedOptions options = resolve(givenOptions(), 2, 100);
  EXPECT_EQ(options.multiscale.voxelSize, 6) << "3 s";
  EXPECT_EQ(options.observation.maxDistance, resolvedMaxDistance(givenOptions().observation, 2, 6));
  EXPECT_EQ(options.trimming.maxHole, 50) << "half of the diagonal";
  EXPECT_EQ(options.trimming.maxGap, 24) << "24 % of the diagonal";
  EXPECT_EQ(options.multiscale.padding, minPadding);
  EXPECT_EQ(options.observation.smoothing, resolvedSmoothing(givenOptions().observation, 2));
  EXPECT_EQ(options.observation.gradientWeight, .4f);
  EXPECT_EQ(options.requested().multiscale.voxelSize, 0);
  EXPECT_EQ(options.requested().trimming.maxGap, 0);
}

TEST(OptionResolver, takesLargerVoxelsWherePointsLieUnevenly)
{
  // Waves as a lidar sees them: rings farther and farther apart, whose points lie as densely as those of the nearest.
  OrientedPoints rings, sheet;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  const auto add = [](OrientedPoints& points, float x, float y) {
    constexpr float waves = 100, height = .02f;
    points.positions.emplace_back(x, y, height * std::sin(waves * x));
    points.normals.push_back(Eigen::Vector3f(-waves * height * std::cos(waves * x), 0, 1).normalized());
  };
  for (int n = 0; n < 20000; ++n) {
    const float around = 6.2832f * unit(random), radius = std::pow(1.2f, std::floor(20 * unit(random)));
    add(rings, radius * std::cos(around), radius * std::sin(around));
    add(sheet, unit(random), unit(random));
  }
  for (const OrientedPoints* points : {&rings, &sheet}) {
    constexpr float spacing = .004f;
    Report report;
    OptionResolver resolver(Options(), densityOf(spacing));
    resolver.chooseByData(*points, *clouds::searchOf(*points), report, serial);
    EXPECT_LT(report.resolution.voxelSize, 3 * spacing) << "which tells nothing of what lies between rings";
    EXPECT_NEAR(resolver.soFar().multiscale.voxelSize, points == &rings ? 4 * spacing : report.resolution.voxelSize,
                1e-6)
        << "at most twice as large";
  }
}

TEST(OptionResolver, smoothsByWhatCoarseVoxelsCanFollowButNotWhereTheyObserve)
{
  Options requested = givenOptions();
  requested.multiscale.voxelSize = 40;
  EXPECT_GT(.15f * 40, resolvedSmoothing(requested.observation, 2));
  EXPECT_EQ(resolve(requested, 2, 100).observation.smoothing, .15f * 40);
  requested.observation.smoothing = 1;
  EXPECT_EQ(resolve(requested, 2, 100).observation.smoothing, 1);

  requested = Options();
  requested.observation.kind = ObservationKind::plane;
  const ResolvedOptions options = resolve(requested, 2, 100);
  EXPECT_EQ(options.observation.smoothing, 0);
  EXPECT_EQ(options.multiscale.voxelSize, 4) << "2 s";
}

TEST(OptionResolver, leavesWhatWasGiven)
{
  Options requested = givenOptions();
  requested.multiscale.voxelSize = .5f;
  requested.multiscale.padding = 9;
  requested.observation.maxDistance = 3;
  requested.observation.smoothing = 1.5f;
  requested.observation.gradientWeight = 2;
  requested.orientation.neighborDistance = 4;
  requested.normals.radius = 5;
  requested.trimming.maxHole = 7;
  const ResolvedOptions options = resolve(requested, 2, 100);
  EXPECT_EQ(options.multiscale.voxelSize, .5f);
  EXPECT_EQ(options.multiscale.padding, 9);
  EXPECT_EQ(options.observation.maxDistance, 3);
  EXPECT_EQ(options.observation.smoothing, 1.5f);
  EXPECT_EQ(options.observation.gradientWeight, 2);
  EXPECT_EQ(options.orientation.neighborDistance, 4);
  EXPECT_EQ(options.normals.radius, 5);
  EXPECT_EQ(options.trimming.maxHole, 7);
  EXPECT_EQ(options.trimming.maxGap, 7) << "as the hole that was given";
}

TEST(OptionResolver, estimatedNormalsGetNoMoreWeightBecauseOfNoise)
{
  // A bumpy ball whose points are noisy, and whose normals are not.
  constexpr int count = 12000;
  constexpr float waves = 20, height = .08f;
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  const auto spacing = static_cast<float>(std::sqrt(4 * M_PI / count));
  OrientedPoints points;
  for (int n = 0; n < count; ++n) {
    const Eigen::Vector3f direction = Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized();
    Eigen::Vector3f p = direction, gradient = direction;
    for (int step = 0; step < 8; ++step) { // to the zero of |p|² − 1 + h Σ sin(w p)
      gradient = 2 * p + height * waves * (waves * p.array()).cos().matrix();
      const float value = p.squaredNorm() - 1 + height * (waves * p.array()).sin().sum();
      p -= value / gradient.dot(direction) * direction;
    }
    points.normals.push_back(gradient.normalized());
    points.positions.push_back(p + .4f * spacing * normal(random) * points.normals.back());
  }
  for (const bool areEstimated : {false, true}) {
    Report report;
    report.normalsEstimated = areEstimated;
    OptionResolver resolver(Options(), densityOf(spacing));
    resolver.chooseByData(points, *clouds::searchOf(points), report, serial);
    resolver.limitTrimming(2);
    EXPECT_EQ(resolver.resolved().observation.gradientWeight, areEstimated ? .4f : 4.f);
  }
}

TEST(OptionResolver, asksTheDataOnlyWhatIsLeftToThem)
{
  Options options;
  EXPECT_TRUE(choosesSmoothing(options) && choosesResolution(options));
  options.observation.noise = .1f;
  EXPECT_FALSE(choosesSmoothing(options));
  EXPECT_TRUE(choosesResolution(options));
  options.multiscale.voxelSize = 1;
  EXPECT_FALSE(choosesResolution(options));
  options = Options();
  options.observation.smoothing = 1;
  options.multiscale.quality = Quality::fine;
  EXPECT_FALSE(choosesSmoothing(options) || choosesResolution(options));
  options = Options();
  options.observation.kind = ObservationKind::plane;
  EXPECT_FALSE(choosesSmoothing(options) || choosesResolution(options));
}
