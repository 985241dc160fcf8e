// SPDX-License-Identifier: BSD-3-Clause
#include "observation/observation.h"
#include "support/shapes.h"

#include <pcl/surface/mrf/options.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

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
  const auto search = makeKdTree();
  search->setPoints(points.positions);
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

TEST(Observation, EveryEstimateIsExactOnAPlane)
{
  const auto sdf = shapes::plane({1, 2, 3});
  const OrientedPoints points = shapes::oriented(shapes::sample(sdf, 1, .1));
  for (const ObservationKind kind : allKinds) {
    ObservationOptions options;
    options.kind = kind;
    const Observation observation = observeAll(points, cube(.8, .2), .1f, .3f, options);
    ASSERT_GT(observation.voxels.size(), 50u);
    for (std::size_t v = 0; v < observation.voxels.size(); ++v) {
      const double truth = sdf(positionOf(observation.lattice, observation.voxels[v]).cast<double>());
      // All tangent planes are the plane itself; single precision of coordinates below 1.
      EXPECT_NEAR(observation.distances[v], truth, 2e-6);
    }
  }
}

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

TEST(Observation, ErrorOnASphereFallsWithTheSpacing)
{
  for (const ObservationKind kind : allKinds) {
    const double coarse = sphereError(kind, .1), fine = sphereError(kind, .05);
    // Tangent planes err by t²/2R: in units of the spacing the error is proportional to it.
    EXPECT_LT(fine, .65 * coarse) << static_cast<int>(kind);
  }
}

TEST(Observation, TrapezoidCorrectsForCurvature)
{
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
  const Observation one = observeAll(points, cube(1.3, .1), .08f, .24f, options, 1);
  for (const int threads : {2, 4}) {
    const Observation more = observeAll(points, cube(1.3, .1), .08f, .24f, options, threads);
    EXPECT_EQ(one.voxels, more.voxels);
    EXPECT_EQ(one.distances, more.distances);
    EXPECT_EQ(one.confidences, more.confidences);
  }
}

TEST(Observation, IsNotWhatThePointsThemselvesAreFor)
{
  const OrientedPoints points = shapes::oriented(shapes::sample(shapes::sphere(1), 1.2, .2));
  EXPECT_THROW(observeAll(points, cube(1.3, .2), .2f, .6f, {}), std::invalid_argument);
}
