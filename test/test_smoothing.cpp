// The smoothing length: found by leaving points out, or set by a known noise.
#include "support/shapes.h"

#include <pcl/surface/mrf/sampling_density.h>
#include <pcl/surface/mrf/smoothing.h>

#include <gtest/gtest.h>

using namespace pcl::mrf;

namespace {

constexpr float spacing = .04f;

SmoothingChoice choose(const PointSet& points, double unit = 1, int threads = 2)
{
  Execution execution(threads);
  return chooseSmoothing(shapes::oriented(points), static_cast<float>(unit) * spacing, 2 * unit * spacing,
                         Prior::triharmonic, {}, execution);
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
  EXPECT_LT(choice.curve[0].error, choice.curve[1].error);
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

TEST(Smoothing, fewPointsGetTheShortestAndNoCurve)
{
  const SmoothingChoice choice = choose(shapes::sample(shapes::sphere(.2), .3, spacing));
  EXPECT_EQ(choice.smoothing, shortestSmoothing(spacing));
  EXPECT_TRUE(choice.curve.empty());
}

TEST(Smoothing, doesNotDependOnTheNumberOfThreads)
{
  const PointSet points = noisyTorus(.5 * spacing);
  const SmoothingChoice one = choose(points, 1, 1), four = choose(points, 1, 4);
  EXPECT_EQ(one.smoothing, four.smoothing);
  EXPECT_EQ(one.noise, four.noise);
}

TEST(Smoothing, ruleForKnownNoise)
{
  EXPECT_EQ(smoothingForNoise(0, 2), shortestSmoothing(2));
  EXPECT_NEAR(smoothingForNoise(2, 2), 2 * 1.5, 1e-12);
  EXPECT_GT(smoothingForNoise(4, 2), smoothingForNoise(2, 2));
}
