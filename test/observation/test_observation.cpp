// SPDX-License-Identifier: BSD-3-Clause
#include "field/prior.h"
#include "observation/observation.h"
#include "observation/point_observation.h"
#include "support/clouds.h"
#include "support/linear_systems.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <tuple>

using namespace pcl::mrf;

namespace {

const std::vector<ObservationKind> allKinds = {ObservationKind::median, ObservationKind::mean, ObservationKind::nearest,
                                               ObservationKind::plane, ObservationKind::trapezoid};

Lattice cube(double halfSide, double spacing)
{
  Lattice lattice;
  const int n = static_cast<int>(std::ceil(2 * halfSide / spacing));
  lattice.size = {n, n + 1, n + 2};
  lattice.spacing = spacing;
  lattice.origin = Eigen::Vector3d::Constant(-.5 * spacing * (n - 1));
  return lattice;
}

Eigen::Vector3f positionOf(const Lattice& lattice, std::int64_t voxel)
{
  const GridSize size = lattice.size;
  return lattice.position(static_cast<int>(voxel % size.x), static_cast<int>(voxel / size.x % size.y),
                          static_cast<int>(voxel / size.planeCount()));
}

Observation observeAll(const OrientedPoints& points, const Lattice& lattice, float spacing, float maxDistance,
                       const ObservationOptions& options, int threads = 1)
{
  Execution execution(threads);
  const auto search = clouds::searchOf(points);
  return observe(points, *search, lattice, spacing, maxDistance, options, execution);
}

/// Root mean square of d° − d over the observed voxels of a sphere of radius 1, in units of the spacing.
double sphereError(ObservationKind kind, double spacing)
{
  const auto sdf = shapes::sphere(1);
  ObservationOptions options;
  options.kind = kind;
  const OrientedPoints points = shapes::oriented(shapes::sample(sdf, 1.2, spacing));
  const Observation observation =
      observeAll(points, cube(1.3, 2 * spacing), static_cast<float>(spacing), static_cast<float>(3 * spacing), options);
  double sum = 0;
  for (std::size_t v = 0; v < observation.voxels.size(); ++v) {
    const double truth = sdf(positionOf(observation.lattice, observation.voxels[v]).cast<double>());
    sum += std::pow((observation.distances[v] - truth) / spacing, 2);
  }
  return std::sqrt(sum / static_cast<double>(observation.voxels.size()));
}

} // namespace

TEST(Observation, ObservesExactlyTheVoxelsNearPoints)
{
  const OrientedPoints points = shapes::oriented(shapes::sample(shapes::torus(1, .4), 1.6, .12));
  for (const ConfidenceShape shape : {ConfidenceShape::linear, ConfidenceShape::quadratic}) {
    ObservationOptions options;
    options.kind = ObservationKind::plane;
    options.confidenceShape = shape;
    const float maxDistance = .31f;
    const Lattice lattice = cube(1.5, .17); // smaller than the torus: points outside the lattice count as well
    const Observation observation = observeAll(points, lattice, .12f, maxDistance, options);
    std::map<std::int64_t, float> confidences;
    for (std::size_t v = 0; v < observation.voxels.size(); ++v) {
      EXPECT_TRUE(v == 0 || observation.voxels[v - 1] < observation.voxels[v]);
      confidences[observation.voxels[v]] = observation.confidences[v];
    }
    for (std::int64_t voxel = 0; voxel < lattice.size.count(); ++voxel) {
      float nearest = std::numeric_limits<float>::max();
      for (const Eigen::Vector3f& p : points.positions)
        nearest = std::min(nearest, (p - positionOf(lattice, voxel)).norm());
      const float t = nearest / maxDistance;
      const float expected = t >= 1 ? 0 : shape == ConfidenceShape::linear ? 1 - t : 1 - t * t;
      const auto found = confidences.find(voxel);
      EXPECT_NEAR(found == confidences.end() ? 0 : found->second, expected, 1e-5) << "voxel " << voxel;
    }
  }
}

TEST(Observation, ErrorOnASphereFallsWithTheSpacingAndByTheTrapezoid)
{
  for (const ObservationKind kind : allKinds) {
    const double coarse = sphereError(kind, .1), fine = sphereError(kind, .05);
    // Tangent planes err by t²/2R: in units of the spacing the error is proportional to it.
    EXPECT_LT(fine, .65 * coarse) << static_cast<int>(kind);
  }
  EXPECT_LT(sphereError(ObservationKind::trapezoid, .05), .8 * sphereError(ObservationKind::plane, .05));
  EXPECT_LT(sphereError(ObservationKind::plane, .05), sphereError(ObservationKind::mean, .05));
}

TEST(Observation, MedianIgnoresAPointOffTheSurface)
{
  OrientedPoints points = shapes::oriented(shapes::sample(shapes::plane({0, 0, 1}), 1, .1));
  std::size_t middle = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points.positions[i].norm() < points.positions[middle].norm())
      middle = i;
  points.positions[middle].z() += .05f;

  const auto largestError = [&](ObservationKind kind) {
    ObservationOptions options;
    options.kind = kind;
    const Observation observation = observeAll(points, cube(.5, .1), .1f, .15f, options);
    double largest = 0;
    for (std::size_t v = 0; v < observation.voxels.size(); ++v)
      largest = std::max<double>(
          largest, std::abs(observation.distances[v] - positionOf(observation.lattice, observation.voxels[v]).z()));
    return largest;
  };
  EXPECT_LT(largestError(ObservationKind::median), 1e-6);
  EXPECT_GT(largestError(ObservationKind::mean), .005); // a fifth of .05 would be .01 where it is among the five
}

TEST(Observation, ConfidenceOfThePointsMultipliesAlphaAndWeighsTheMean)
{
  OrientedPoints points;
  points.positions = {{0, 0, 0}, {0, 0, .2f}};
  points.normals = {{0, 0, 1}, {0, 0, 1}};
  points.origins = {0, 1};
  points.confidences = {1, .25f};
  Lattice lattice;
  lattice.size = {1, 1, 1};
  lattice.origin = {0, 0, .1};
  lattice.spacing = 1;
  ObservationOptions options;
  options.kind = ObservationKind::mean;
  options.neighbors = 2;
  options.confidenceShape = ConfidenceShape::linear;
  const Observation observation = observeAll(points, lattice, .2f, 1, options);
  ASSERT_EQ(observation.voxels.size(), 1u);
  EXPECT_NEAR(observation.distances[0], (.1 * 1 - .1 * .25) / 1.25, 1e-6);
  EXPECT_NEAR(observation.confidences[0], (1 - .1) * .625, 1e-6);
}

TEST(Observation, DoesNotDependOnTheNumberOfThreads)
{
  const OrientedPoints points = shapes::oriented(shapes::sample(shapes::sphere(1), 1.2, .08));
  ObservationOptions options;
  options.kind = ObservationKind::plane;
  sameOnAnyThreads([&](int threads) {
    const Observation o = observeAll(points, cube(1.3, .1), .08f, .24f, options, threads);
    return std::make_tuple(o.voxels, o.distances, o.confidences);
  });
}

// Observations at the points: the block operator compared with its definition, merging, and all solvers.

using namespace systems;

namespace {

PointSample sampleAt(const Eigen::Vector3f& position, const Eigen::Vector3f& normal = Eigen::Vector3f::UnitZ(),
                     float weight = 1)
{
  return {position, normal, weight};
}

/// The trilinear interpolant of voxel values and its gradient, by their definition.
double interpolate(GridSize size, const std::vector<double>& d, const Eigen::Vector3f& at, Eigen::Vector3d& gradient)
{
  const int sizes[3] = {size.x, size.y, size.z};
  int lower[3];
  double t[3];
  for (int axis = 0; axis < 3; ++axis) {
    lower[axis] = std::max(0, std::min(static_cast<int>(std::floor(at[axis])), sizes[axis] - 2));
    t[axis] = sizes[axis] == 1 ? 0 : static_cast<double>(at[axis]) - lower[axis];
  }
  double value = 0;
  gradient.setZero();
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    Eigen::Vector3d slopes = Eigen::Vector3d::Ones();
    int voxel[3];
    for (int axis = 0; axis < 3; ++axis) {
      const int upper = corner >> axis & 1;
      voxel[axis] = std::min(lower[axis] + upper, sizes[axis] - 1);
      const double share = upper ? t[axis] : 1 - t[axis];
      weight *= share;
      for (int other = 0; other < 3; ++other)
        slopes[other] *= other == axis ? (upper ? 1. : -1.) : share;
    }
    const double x = d[static_cast<std::size_t>(size.index(voxel[0], voxel[1], voxel[2]))];
    value += weight * x;
    gradient += slopes * x;
  }
  return value;
}

/// Half the energy of the data, except for a constant: Σ ρ (½ v (cᵀd)² + ½ g ‖G d − u n‖²).
double energyOf(GridSize size, const std::vector<PointSample>& samples, const PointWeights& weights, double unit,
                const std::vector<double>& d)
{
  double energy = 0;
  for (const PointSample& sample : samples) {
    Eigen::Vector3d gradient;
    const double value = interpolate(size, d, sample.position, gradient);
    energy += sample.weight * (.5 * weights.value * value * value +
                               .5 * weights.gradient * (gradient - unit * sample.normal.cast<double>()).squaredNorm() -
                               .5 * weights.gradient * unit * unit * sample.normal.cast<double>().squaredNorm());
  }
  return energy;
}

constexpr GridSize flatGrids[] = {{7, 6, 5}, {1, 5, 4}, {6, 1, 3}, {4, 5, 1}, {2, 2, 2}};

} // namespace

TEST(PointObservation, isTheDerivativeOfItsEnergy)
{
  for (const GridSize size : flatGrids) {
    const auto samples = randomSamples(size, 40, 3, true);
    const PointWeights weights{3, .7};
    const double unit = .25;
    const LinearSystem system = assembleAtPoints(size, Prior::membrane, samples, weights, unit, serial);
    const auto d = oracle::randomValues(static_cast<std::size_t>(size.count()), -1, 1, 5);
    // C of a system of order 1.
    const oracle::Vector product = (oracle::Matrix(system.matrix) - oracle::laplacian(size)) * asVector(d);
    double quadratic = 0, linear = 0;
    for (std::size_t i = 0; i < d.size(); ++i) {
      quadratic += d[i] * product[static_cast<Eigen::Index>(i)];
      linear += d[i] * system.rightHandSide[i];
    }
    EXPECT_NEAR(.5 * quadratic - linear, energyOf(size, samples, weights, unit, d), 1e-9);
    // The energy is a quadratic function: central differences are its derivative but for rounding.
    for (std::size_t i = 0; i < d.size(); ++i) {
      std::vector<double> above = d, below = d;
      above[i] += .5;
      below[i] -= .5;
      const double slope =
          energyOf(size, samples, weights, unit, above) - energyOf(size, samples, weights, unit, below);
      EXPECT_NEAR(product[static_cast<Eigen::Index>(i)] - system.rightHandSide[i], slope, 1e-9);
    }
  }
}

TEST(PointObservation, noiseWeighsByItsInverseSquareBesideConfidences)
{
  OrientedPoints points;
  points.positions.assign(4, Eigen::Vector3f(1, 1, 1));
  points.normals.assign(4, Eigen::Vector3f::UnitZ());
  points.confidences = {.5f, .5f, 1, 1};
  points.deviations = {.25f, .5f, 1, 100};
  const Lattice lattice{{3, 3, 3}, Eigen::Vector3d::Zero(), 1};
  const auto weights = [&] {
    std::vector<float> result;
    for (const PointSample& sample : toSamples({points, lattice, 1}, serial))
      result.push_back(sample.weight);
    return result;
  };
  EXPECT_EQ(weights(), points.confidences) << "no typical deviation: they say nothing";
  points.typicalDeviation = .5f;
  EXPECT_EQ(weights(), (std::vector<float>{2, .5f, .25f, 1.f / 256})) << "ratios up to 16 count";
}

TEST(PointObservation, mergingKeepsWeightsAndMeans)
{
  Execution execution(2);
  const std::vector<PointSample> samples = {sampleAt({.1f, .2f, .3f}, {1, 0, 0}, 1),
                                            sampleAt({.3f, .2f, .1f}, {0, 1, 0}, 3), sampleAt({.6f, .2f, .1f}),
                                            sampleAt({-.1f, .2f, .1f}, {0, 0, 1}, .5f)};
  const std::vector<PointSample> merged = merge(samples, .5f, execution);
  ASSERT_EQ(merged.size(), 3u);
  // In the order of the cubes.
  EXPECT_EQ(merged[0].position, samples[3].position);
  EXPECT_FLOAT_EQ(merged[1].weight, 4);
  EXPECT_LT((merged[1].position - Eigen::Vector3f(.25f, .2f, .15f)).norm(), 1e-6);
  EXPECT_LT((merged[1].normal - Eigen::Vector3f(.25f, .75f, 0)).norm(), 1e-6);
  EXPECT_EQ(merged[2].position, samples[2].position);
}

TEST(PointObservation, weightsBalanceThePriorAtTheSmoothingLength)
{
  // τ (h/ℓ)^(2k−1) is the number of points per voxel face, whatever the grid.
  for (const Prior prior : allPriors)
    for (const double h : {1., 2.}) {
      const PointWeights weights = pointWeights(prior, .6, 1, h, .4);
      EXPECT_NEAR(1 / weights.value * std::pow(h / .6, 2 * order(prior) - 1), h * h / 4, 1e-12);
      EXPECT_NEAR(weights.gradient / weights.value, .4 * .6 * .6 / (h * h), 1e-12);
    }
}
