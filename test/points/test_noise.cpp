// SPDX-License-Identifier: BSD-3-Clause
#include "points/noise.h"

#include "base/select_values.h"
#include "points/sampling_density.h"
#include "support/clouds.h"
#include "support/depth_image.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

using namespace pcl::mrf;

namespace {

OrientedPoints withSpacings(const PointSet& points)
{
  const auto search = clouds::searchOf(points);
  OrientedPoints result = shapes::oriented(points);
  result.spacings = localSpacings(points, measureNeighbors(points, *search, serial), serial);
  result.sensors = points.sensors;
  return result;
}

/// A wall of points 1 apart, with noise of deviation 2. \param step of their heights; 0: any height
OrientedPoints wall(int reach, float step)
{
  const std::vector<float> noise = depth_image::noise(reach);
  PointSet points;
  for (std::size_t n = 0; n < noise.size(); ++n) {
    const float height = 2 * noise[n];
    points.positions.emplace_back(n % depth_image::side, n / depth_image::side,
                                  step > 0 ? step * std::round(height / step) : height);
  }
  points.normals.assign(points.size(), Eigen::Vector3f::UnitZ());
  return withSpacings(points);
}

OrientedPoints firstOf(const OrientedPoints& points, std::size_t count)
{
  return select(points, spreadIndices(count, count));
}

OrientedPoints depthImage(const std::function<float(float depth)>& deviation, int reach)
{
  return withSpacings(depth_image::plane(deviation, reach));
}

NoiseModel modelOf(const OrientedPoints& points, int threads = 1, double known = 0)
{
  Execution execution(threads);
  const auto search = clouds::searchOf(points);
  return estimateNoise(points, *search, known, execution);
}

} // namespace

TEST(Noise, WhiteNoiseIsMeasured)
{
  constexpr float deviation = .01f;
  const NoiseModel model = modelOf(depthImage([](float) { return deviation; }, 0));
  EXPECT_FALSE(model.isCorrelated);
  for (const NoiseGroup& group : model.groups) {
    EXPECT_FALSE(group.isCorrelated());
    // The group's depths differ by a fifth, and the first quartile is that of neighborhoods that overlap.
    const double depth = group.key / std::sqrt(1 + 1 / (group.key * group.key));
    const double acrossThePlane = deviation / depth; // y / |(x, y, 1)| of the error along the ray
    EXPECT_NEAR(group.deviation, acrossThePlane, .35 * acrossThePlane) << group.key;
  }
}

TEST(Noise, NoiseThatPixelsShareIsSeenWithItsLaw)
{
  constexpr float atOne = .004f;
  const OrientedPoints points = depthImage([](float depth) { return atOne * depth * depth; }, 2);
  const NoiseModel model = modelOf(points);
  ASSERT_TRUE(model.isCorrelated);
  EXPECT_TRUE(model.isByRange);
  // Across the plane σ grows with the depth, and the points are apart as depth^1.5, so that ℓ goes with depth^1.4, and
  // what weighs with its power of 2.5: more than is allowed.
  EXPECT_DOUBLE_EQ(model.exponent, 3);
  EXPECT_GT(model.groups.back().deviation, 1.5 * model.groups.front().deviation);
  for (const NoiseGroup& group : model.groups)
    EXPECT_LT(group.white, .8 * group.deviation);
  for (const NoiseGroup& group : model.groups) {
    EXPECT_GT(group.correlation, group.side); // two pixels are averaged on each side
    EXPECT_GE(1.001 * model.smoothing * std::pow(group.key / model.medianKey, .4 * model.exponent), 1.5 * group.side);
  }
}

/// Correlated noise that is too weak to set the smoothing length makes the length from held-out points longer, unless
/// each point has independent noise or the noise is known.
TEST(Noise, ALittleThatPixelsShareLengthensSmoothing)
{
  const auto ofDepth = [](float depth) { return .0012f * depth * depth; };
  const OrientedPoints points = depthImage(ofDepth, 2);
  const NoiseModel shared = modelOf(points);
  ASSERT_FALSE(shared.isCorrelated || shared.isStrong);
  EXPECT_GT(shared.lengthening, 1.3);
  EXPECT_LT(shared.lengthening, 1.85) << "the longest length that noise is shared over";
  EXPECT_TRUE(shared.weighsPoints());
  EXPECT_NEAR(shared.exponent, 1, .4) << "across the plane, that of the depth less one";
  EXPECT_EQ(modelOf(depthImage(ofDepth, 0)).lengthening, 1);
  EXPECT_EQ(modelOf(points, 1, .005).lengthening, 1);
}

/// In thick layers of points the nearest neighbors in space have similar heights, whatever the noise is.
TEST(Noise, SheetsOfAQuantisedRangeAreNoWhiteNoise)
{
  const NoiseModel white = modelOf(wall(0, 0)), quantised = modelOf(wall(2, 4));
  EXPECT_FALSE(white.isCorrelated);
  EXPECT_TRUE(quantised.isCorrelated);
  EXPECT_FALSE(quantised.isByRange) << "nobody knows a sensor";
  for (const NoiseGroup& group : white.groups)
    EXPECT_NEAR(group.deviation, 2, .5); // the first quartile of few neighborhoods
  for (const NoiseGroup& group : quantised.groups)
    EXPECT_LT(group.white, .1 * group.deviation);
}

/// Windows of a facade: among few points they are edges; among as many as are used, roughness grows with their number.
TEST(Noise, ReliefIsNone)
{
  constexpr float whiteNoise = .3f;
  const std::vector<float> noise = depth_image::noise(0);
  PointSet points;
  for (std::size_t n = 0; n < noise.size(); ++n) {
    const std::size_t x = n % depth_image::side, y = n / depth_image::side;
    points.positions.emplace_back(x, y, (x / 15 % 2 == 0 && y / 15 % 2 == 0 ? -4 : 0) + whiteNoise * noise[n]);
  }
  points.normals.assign(points.size(), Eigen::Vector3f::UnitZ());
  const NoiseModel model = modelOf(withSpacings(points));
  ASSERT_EQ(model.groups.size(), 6U);
  EXPECT_FALSE(model.isCorrelated);
  EXPECT_EQ(model.lengthening, 1);
  for (const NoiseGroup& group : model.groups)
    EXPECT_NEAR(group.deviation, whiteNoise, .5 * whiteNoise);
}

TEST(Noise, TheOtherWallOfAThinObjectIsNone)
{
  PointSet points;
  for (int n = 0; n < 100 * 100; ++n)
    for (const float z : {0.f, 3.f}) {
      points.positions.emplace_back(n % 100, n / 100, z);
      points.normals.emplace_back(0, 0, z - 1.5f < 0 ? -1 : 1);
    }
  const NoiseModel model = modelOf(withSpacings(points));
  ASSERT_EQ(model.groups.size(), 6U);
  EXPECT_FALSE(model.isCorrelated || model.isStrong);
  // Whoever sees but one of the walls, from one place, calls two layers noise.
  points.sensors = {Eigen::Vector3f(50, 50, 1000)};
  EXPECT_TRUE(modelOf(withSpacings(points)).isStrong);
}

/// The nearest 384 points surround the rod, so that a quadric leaves a residual there; the noise of the nearest 12
/// points is only a part of it.
TEST(Noise, TheRoundOfARodIsNone)
{
  constexpr int around = 24, along = 500;
  const std::vector<float> noise = depth_image::noise(0);
  PointSet points;
  for (int n = 0; n < around * along; ++n) {
    const float angle = 2 * static_cast<float>(EIGEN_PI) * static_cast<float>(n % around) / around;
    points.normals.emplace_back(std::cos(angle), std::sin(angle), 0);
    points.positions.push_back((around / (2 * EIGEN_PI) + .25f * noise[n]) * points.normals.back() +
                               static_cast<float>(n / around) * Eigen::Vector3f::UnitZ());
  }
  const NoiseModel model = modelOf(withSpacings(points));
  ASSERT_EQ(model.groups.size(), 6U);
  EXPECT_FALSE(model.isCorrelated || model.isStrong);
  for (const NoiseGroup& group : model.groups)
    EXPECT_NEAR(group.deviation, .25, .1);
}

/// The nearest points of a ring lie in the plane of its rays, whatever their noise; on the wall of an alley the next
/// rings are a meter away.
TEST(Noise, WhatDiffersBetweenTheRingsOfALidarIsNone)
{
  constexpr int rings = 16, rays = 3600;
  const std::vector<float> noise = depth_image::noise(0);
  PointSet points;
  for (int n = 0; n < rings * rays; ++n) {
    const float angle = 2 * static_cast<float>(EIGEN_PI) * static_cast<float>(n % rays) / rays,
                slope = std::tan(static_cast<float>(EIGEN_PI) * static_cast<float>(2 * (n / rays) - rings + 1) / 180);
    const Eigen::Vector3f ray(std::cos(angle), std::sin(angle), slope);
    const float range = std::min(3 / std::abs(ray.x()), 30 / std::abs(ray.y()));
    points.positions.push_back(range * ray + .02f * noise[n % noise.size()] * ray.normalized());
    points.normals.push_back(Eigen::Vector3f::UnitX() * (ray.x() < 0 ? 1 : -1));
  }
  for (const bool isSensorKnown : {true, false}) {
    if (isSensorKnown)
      points.sensors = {Eigen::Vector3f::Zero()};
    else
      points.sensors.clear();
    OrientedPoints measured = withSpacings(points);
    const NoiseModel model = modelOf(measured);
    ASSERT_EQ(model.groups.size(), 6U);
    EXPECT_FALSE(model.isCorrelated || model.isStrong);
    // Nor is a length that it asks for where it is known.
    measured.deviations.assign(measured.size(), .5f * quantile(measured.spacings, .5));
    EXPECT_LT(modelOf(measured).smoothing, 2 * quantile(measured.spacings, .5));
  }
}

TEST(Noise, BecomesTheDeviationOfEachPoint)
{
  OrientedPoints points = depthImage([](float depth) { return .01f * depth * depth; }, 1);
  const NoiseModel model = modelOf(points);
  setDeviations(points, model, serial);
  EXPECT_FLOAT_EQ(points.typicalDeviation, static_cast<float>(model.deviation));
  for (std::size_t i = 0; i < points.size(); i += 97)
    EXPECT_NEAR(points.deviation(i),
                model.deviation * std::pow(points.positions[i].norm() / model.medianKey, model.exponent),
                1e-5 * points.deviation(i));
}

TEST(Noise, ThatIsKnownIsTaken)
{
  OrientedPoints points = depthImage([](float depth) { return .004f * depth * depth; }, 2);
  points.deviations = deviationsByLaw(*noiseLaw("quadratic:.5,.25"), points, serial);
  const NoiseModel model = modelOf(points);
  EXPECT_TRUE(model.isCorrelated) << "as the cloud shows";
  for (std::size_t i = 0; i < points.size(); i += 97) {
    const float range = points.positions[i].norm();
    EXPECT_FLOAT_EQ(static_cast<float>(model.deviationAt(points, i)), .5f + .25f * range * range);
  }
  EXPECT_NEAR(model.deviation, median(points.deviations), 1e-3);
  points.deviations.clear();
  EXPECT_EQ(modelOf(points, 1, .125).deviation, .125);
}

TEST(Deviations, AreThoseOfTheSensorThatSaw)
{
  PointSet points;
  points.positions = {{0, 0, 1}, {0, 0, 9}, {0, 0, 0}};
  const NoiseLaw law = *noiseLaw("tof:.5,.25");
  using Values = std::vector<float>;
  EXPECT_TRUE(deviationsByLaw(law, points, serial).empty());
  points.sensors = {{0, 0, 0}, {0, 0, 10}};
  EXPECT_EQ(deviationsByLaw(law, points, serial), (Values{.75f, .75f, .5f})) << "the nearest";
  EXPECT_TRUE(deviationsByLaw(*noiseLaw("constant:1"), points, serial).empty());
  // Where there is no noise, one point still has no endless weight.
  EXPECT_GT(deviationsByLaw(*noiseLaw("kinect"), points, serial)[2], 0);
  points.views = {1, 1, 0};
  EXPECT_EQ(deviationsByLaw(law, points, serial), (Values{2.75f, .75f, .5f}));
}

TEST(Noise, OfFewPointsIsUnknown)
{
  EXPECT_TRUE(modelOf(firstOf(depthImage([](float) { return .01f; }, 0), 1000)).groups.empty());
}

TEST(Noise, IsFollowedOfManyPointsOnly)
{
  const auto isFollowed = [](const NoiseModel& model) { return model.isStrong || model.isCorrelated; };
  for (const OrientedPoints& points : {wall(0, 0), wall(2, 4)}) {
    EXPECT_TRUE(isFollowed(modelOf(points)));
    const NoiseModel few = modelOf(firstOf(points, 5000));
    EXPECT_GT(std::count_if(few.groups.begin(), few.groups.end(), [](const NoiseGroup& g) { return g.isStrong(); }), 3);
    EXPECT_FALSE(isFollowed(few));
  }
}

TEST(Noise, DoesNotDependOnThreads)
{
  const OrientedPoints points = depthImage([](float depth) { return .01f * depth; }, 1);
  sameOnAnyThreads([&](int threads) {
    std::vector<double> deviations;
    for (const NoiseGroup& group : modelOf(points, threads).groups)
      deviations.push_back(group.deviation);
    return deviations;
  });
}
