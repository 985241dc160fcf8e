// SPDX-License-Identifier: BSD-3-Clause
#include "field/interpolation.h"
#include "field/prior.h"
#include "levels/multiscale.h"
#include "support/clouds.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>

#include <Eigen/LU>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

using namespace pcl::mrf;

namespace {

Workload ofArea(double area)
{
  Workload workload;
  workload.area = area;
  return workload;
}

MultiscaleResult regularizePoints(const PointSet& points, float spacing, const Options& options = {})
{
  const auto search = clouds::searchOf(points);
  const OrientedPoints oriented = shapes::oriented(points);
  return regularize({&oriented, search.get(), boundingBox(points.positions)}, spacing, options, serial);
}

Options observingPlanes()
{
  Options options;
  options.observation.kind = ObservationKind::plane;
  return options;
}

/// Root mean square of the field's value at exact surface points, in units of the voxel side.
double surfaceError(const DistanceField& field, const PointSet& truth)
{
  std::vector<double> errors;
  for (const Eigen::Vector3f& p : truth.positions)
    errors.push_back(field.sampleDistance(p) / field.lattice().spacing);
  return rootMeanSquare(errors);
}

/// The number that follows a phrase of a message.
float numberAfter(const std::string& phrase, const std::string& message)
{
  const std::size_t at = message.find(phrase);
  EXPECT_NE(at, std::string::npos) << message;
  return at != std::string::npos ? std::stof(message.substr(at + phrase.size())) : 0;
}

/// The root mean square and the maximum of the difference of two fields, relative to the root mean square of the first.
std::pair<double, double> differences(const DistanceField& a, const DistanceField& b)
{
  double squares = 0, norm = 0, largest = 0;
  EXPECT_EQ(a.lattice().size, b.lattice().size);
  shapes::forVoxels(a.lattice().size, [&](int i, int j, int k) {
    const double value = a.distance(i, j, k), difference = b.distance(i, j, k) - value;
    squares += difference * difference;
    norm += value * value;
    largest = std::max(largest, std::abs(difference));
  });
  return {std::sqrt(squares / norm), largest};
}

/// The values of a function at the centers of the voxels.
template <typename Function>
std::vector<float> valuesOf(const Function& function, const Lattice& lattice)
{
  std::vector<float> values;
  shapes::forVoxels(lattice.size, [&](int i, int j, int k) {
    values.push_back(static_cast<float>(function(lattice.origin + lattice.spacing * Eigen::Vector3d(i, j, k))));
  });
  return values;
}

} // namespace

TEST(PlanLevels, AreNestedAndPadded)
{
  const BoundingBox object{{-1, -2, .5f}, {3, 1, 9}};
  MultiscaleOptions options;
  const auto levels = planLevels(object, .05f, ofArea(1), options);
  ASSERT_GT(levels.size(), 3u);
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const Lattice& level = levels[l];
    const Eigen::Vector3d side = level.spacing * Eigen::Vector3d(level.size.x, level.size.y, level.size.z);
    const Eigen::Vector3d lower = level.origin - Eigen::Vector3d::Constant(level.spacing / 2);
    EXPECT_LE((lower - object.lower.cast<double>()).maxCoeff(), -6 * .05 + 1e-9);
    EXPECT_GE((lower + side - object.upper.cast<double>()).minCoeff(), 6 * .05 - 1e-9);
    if (l == 0)
      continue;
    const Lattice& coarser = levels[l - 1];
    EXPECT_NEAR(coarser.spacing, 2 * level.spacing, 1e-12);
    const Eigen::Vector3d coarserLower = coarser.origin - Eigen::Vector3d::Constant(coarser.spacing / 2);
    const Eigen::Vector3d coarserUpper =
        coarserLower + coarser.spacing * Eigen::Vector3d(coarser.size.x, coarser.size.y, coarser.size.z);
    EXPECT_LE((coarserLower - lower).maxCoeff(), 1e-9);
    EXPECT_GE((coarserUpper - lower - side).minCoeff(), -1e-9);
    const Eigen::Vector3d offset = (lower - coarserLower) / coarser.spacing * 2;
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(offset[axis], std::round(offset[axis]), 1e-6) << "voxel faces do not coincide";
  }
  const GridSize coarsest = levels.front().size;
  EXPECT_LE(std::max({coarsest.x, coarsest.y, coarsest.z}), coarsestSide);
  EXPECT_NEAR(levels.back().spacing, .05, 1e-8);
}

TEST(PlanLevels, RefusesWhatDoesNotFitAndNamesWhatWould)
{
  const BoundingBox object{{0, 0, 0}, {1, 1, 1}};
  MultiscaleOptions options;
  options.maxMemory = std::size_t{64} << 20;
  const std::string message = clouds::messageOf<ResourceLimit>([&] { planLevels(object, .002f, ofArea(1), options); });
  const float fitting = numberAfter("a voxel size of ", message);
  EXPECT_GT(fitting, .002f);
  EXPECT_NO_THROW(planLevels(object, 1.01f * fitting, ofArea(1), options));

  // Cholesky is not to take too long, either.
  options.maxMemory = std::size_t{8} << 30;
  Workload workload = ofArea(1);
  workload.solver.method = SolverMethod::cholesky;
  const std::string slow = clouds::messageOf<ResourceLimit>([&] { planLevels(object, .03f, workload, options); });
  EXPECT_NE(slow.find(" s, in which the run could not be cancelled; a voxel size of "), std::string::npos) << slow;
  const std::string large = clouds::messageOf<ResourceLimit>([&] { planLevels(object, .01f, workload, options); });
  const float inTime = numberAfter("a voxel size of ", large);
  EXPECT_NO_THROW(planLevels(object, 1.01f * inTime, workload, options)) << large;

  options.padding = 1;
  EXPECT_THROW(planLevels(object, .1f, ofArea(1), options), InvalidOption);
}

TEST(PlanLevels, RefusesEmptyVolumesForSlowSolvers)
{
  const BoundingBox object{{0, 0, 0}, {1, 1, 1}};
  MultiscaleOptions options;
  options.padding = 100;
  Workload workload = ofArea(1);
  workload.points = 324;
  EXPECT_NO_THROW(planLevels(object, .1f, workload, options));
  for (const SolverMethod method : {SolverMethod::icm, SolverMethod::cg}) {
    workload.solver.method = method;
    workload.points = 324;
    const std::string message = clouds::messageOf<ResourceLimit>([&] { planLevels(object, .1f, workload, options); });
    EXPECT_NE(message.find("take multigrid"), std::string::npos) << message;
    workload.points = 1e5;
    EXPECT_NO_THROW(planLevels(object, .1f, workload, options));
  }
}

TEST(PlanLevels, AsManyThreadsSweepAsFit)
{
  const BoundingBox object{{0, 0, 0}, {1, 1, 1}};
  MultiscaleOptions options;
  options.maxMemory = std::size_t{4} << 30;
  const auto threads = [&](int wanted) { return affordableThreads(object, .001f, ofArea(6), options, wanted); };
  EXPECT_EQ(threads(2), 2);
  const int most = threads(1000);
  EXPECT_GT(most, 2);
  EXPECT_LT(most, 1000);
  options.maxMemory *= 2;
  EXPECT_GT(threads(1000), most);
  options.maxMemory = 1; // planLevels refuses this
  EXPECT_EQ(threads(4), 1);
}

TEST(PlanLevels, LongAxesAreStoredWhereTheyCostLeast)
{
  const auto order = [](int x, int y, int z) { return bandAxes({x, y, z}).axes; };
  using Axes = std::array<int, 3>;
  EXPECT_EQ(order(100, 110, 120), (Axes{0, 1, 2})) << "not worth the while";
  EXPECT_EQ(order(140, 100, 120), (Axes{0, 1, 2}));
  EXPECT_EQ(order(10000, 9000, 100), (Axes{1, 2, 0})) << "terrain";
  EXPECT_EQ(order(100, 9000, 10000), (Axes{1, 0, 2})) << "a wall";
  EXPECT_EQ(order(90, 10000, 100), (Axes{2, 0, 1})) << "a corridor";
  for (const Axes& axes : {Axes{0, 1, 2}, Axes{1, 2, 0}, Axes{2, 0, 1}, Axes{1, 0, 2}, Axes{0, 2, 1}, Axes{2, 1, 0}}) {
    const AxisOrder any{axes};
    const Eigen::Vector3f v(1, 2, 3);
    EXPECT_EQ(any.fromStored(any.toStored(v)), v);
    EXPECT_EQ(any.toStored(v)[0], v[axes[0]]);
    Eigen::Matrix3f stored;
    for (int axis = 0; axis < 3; ++axis)
      stored.col(axis) = any.toStored(Eigen::Vector3f(Eigen::Vector3f::Unit(axis)));
    EXPECT_EQ(any.isMirrored(), stored.determinant() < 0);
  }
}

TEST(DenseVoxels, FollowThePointsWhereThereAreFew)
{
  MultiscaleOptions options;
  EXPECT_EQ(resolvedDenseVoxels(options, 0), 1 << 18);
  EXPECT_EQ(resolvedDenseVoxels(options, 1000), 350000);
  EXPECT_EQ(resolvedDenseVoxels(options, 30000), 1 << 20);
  EXPECT_EQ(resolvedDenseVoxels(options, std::numeric_limits<std::size_t>::max()), 1 << 20);
  options.denseVoxels = 7;
  EXPECT_EQ(resolvedDenseVoxels(options, 1000), 7);
}

// Two plates face each other across an empty space.
TEST(Regularize, SolvesSprawlingCloudsOfFewPointsInBands)
{
  constexpr float spacing = .04f, apart = 6;
  PointSet points = shapes::sample([](const Eigen::Vector3d& x) { return x.z(); }, .5, spacing);
  PointSet facing = points;
  for (Eigen::Vector3f& normal : facing.normals)
    normal = -normal;
  clouds::append(points, facing, Eigen::Vector3f::Constant(apart));
  const LevelReport finest = regularizePoints(points, spacing).levels.back();
  EXPECT_GT(finest.size.count(), 400000);
  EXPECT_LT(finest.unknowns, finest.size.count() / 5);
}

TEST(PlanLevels, MemoryFollowsTheSurfaceOfTerrainsAndCorridors)
{
  // A terrain of 10⁴ × 10⁴ voxels by 100, and a corridor of 10⁵ by 100 × 100: what the surface itself takes is some
  // 450 bytes per face with what is kept between sweeps where one does not do (45 GB, 18 GB); the rest is to be small
  // beside it, however the axes lie.
  MultiscaleOptions options;
  for (const Eigen::Vector3f& sides : {Eigen::Vector3f(10000, 10000, 100), Eigen::Vector3f(100000, 100, 100)}) {
    const double area = sides.minCoeff() == sides[1] ? 4e7 : 1e8;
    options.maxMemory = static_cast<std::size_t>(1.05 * 450 * area);
    for (const Eigen::Vector3f& turned :
         {sides, Eigen::Vector3f(sides[1], sides[2], sides[0]), Eigen::Vector3f(sides[2], sides[0], sides[1])}) {
      EXPECT_NO_THROW(planLevels({{0, 0, 0}, turned}, 1, ofArea(area), options)) << turned.transpose();
      EXPECT_EQ(affordableThreads({{0, 0, 0}, turned}, 1, ofArea(area), options, 2), 2);
    }
  }
  EXPECT_THROW(planLevels({{0, 0, 0}, {3e6f, 1, 1}}, 1, ofArea(100), options), ResourceLimit)
      << "too long to be counted";
}

TEST(PlanLevels, RefusesPlanesAndRowsThat32BitsCannotCount)
{
  MultiscaleOptions options;
  options.maxMemory = std::numeric_limits<std::size_t>::max(); // memory is not what is short
  for (const Eigen::Vector3f& sides : {Eigen::Vector3f(300000, 200000, 150000), Eigen::Vector3f(90000, 90000, 90000)}) {
    const std::string message = clouds::messageOf<ResourceLimit>([&] {
      planLevels({{0, 0, 0}, sides}, 1, ofArea(100), options);
    });
    const float factor = numberAfter("choose voxels ", message);
    EXPECT_GT(factor, 1);
    EXPECT_NO_THROW(planLevels({{0, 0, 0}, sides}, 1.01f * factor, ofArea(100), options)) << message;
  }
  EXPECT_NO_THROW(planLevels({{0, 0, 0}, {60000, 60000, 100}}, 1, ofArea(100), options));
}

/// Expects the interpolation of a function between nested lattices to be exact, far enough from the border of the
/// coarser one. \param error of single precision
template <typename Function, typename Interpolate>
void expectReproduced(const Function& function, const Interpolate& interpolate, double error)
{
  const Lattice coarse{{12, 11, 10}, {-2, 1, .25}, .5}, fine{{14, 12, 11}, {-.875, 1.875, 1.375}, .25};
  Execution execution(2);
  const auto interpolated = interpolate(valuesOf(function, coarse), coarse, fine, execution);
  const auto expected = valuesOf(function, fine);
  ASSERT_EQ(interpolated.size(), expected.size());
  for (std::size_t v = 0; v < expected.size(); ++v)
    EXPECT_NEAR(interpolated[v], expected[v], error);
}

TEST(Interpolate, ReproducesPolynomialsAwayFromTheBorder)
{
  const auto trilinear = [](const Eigen::Vector3d& x) {
    return 1 + x.x() - 2 * x.y() * x.z() + .3 * x.x() * x.y() * x.z() - x.z();
  };
  const auto cubic = [](const Eigen::Vector3d& x) {
    return 1 + x.x() - 2 * x.y() * x.z() + .3 * x.x() * x.x() * x.x() - x.z() * x.z() * x.y() * x.x() +
           .1 * x.y() * x.y() * x.y();
  };
  expectReproduced(trilinear, interpolateLinear, 1e-4); // values reach 50
  expectReproduced(cubic, interpolateCubic, 1e-4);      // and 100
}

TEST(Interpolate, LinearStaysWithinItsNeighborsAndAtTheBorderWithItsParent)
{
  const Lattice coarse{{3, 1, 1}, {0, 0, 0}, 2}, fine{{6, 2, 2}, {-.5, -.5, -.5}, 1};
  const auto values = interpolateLinear({0, 8, 0}, coarse, fine, serial);
  for (int z = 0; z < 2; ++z)
    for (int y = 0; y < 2; ++y)
      for (const auto& [x, value] : {std::pair(0, 0), std::pair(1, 2), std::pair(2, 6), std::pair(3, 6)})
        EXPECT_FLOAT_EQ(values[fine.size.index(x, y, z)], static_cast<float>(value));
}

class EveryModel : public testing::TestWithParam<std::tuple<ObservationKind, Prior>> {};

TEST_P(EveryModel, FitsASphereBetterOnAFinerGrid)
{
  Options options;
  std::tie(options.observation.kind, options.prior.kind) = GetParam();
  const auto sdf = shapes::sphere(1);
  const PointSet truth = shapes::sample(sdf, 1.2, .09, 7);
  const auto errorAt = [&](float spacing) {
    const PointSet points = shapes::sample(sdf, 1.2, spacing);
    return surfaceError(regularizePoints(points, spacing, options).field, truth);
  };
  const double coarse = errorAt(.12f), fine = errorAt(.06f);
  EXPECT_LT(coarse, .1);
  // In voxel sides the curvature error is proportional to h; a hundredth of a voxel is what the solver leaves.
  EXPECT_LT(fine, std::max(.7 * coarse, .01));
}

INSTANTIATE_TEST_SUITE_P(Regularize, EveryModel,
                         testing::Combine(testing::Values(ObservationKind::points, ObservationKind::plane),
                                          testing::Values(Prior::membrane, Prior::thinPlate, Prior::triharmonic)));

TEST(Regularize, FillsAHoleInASphere)
{
  const auto sdf = shapes::sphere(1);
  const auto isHole = [](const Eigen::Vector3f& p) { return (p - Eigen::Vector3f(0, .6f, .8f)).norm() < .5f; };
  const PointSet all = shapes::sample(sdf, 1.2, .06);
  const PointSet points = shapes::filter(all, [&](const Eigen::Vector3f& p) { return !isHole(p); });
  const PointSet hole = shapes::filter(all, isHole);
  std::vector<double> errors;
  for (const Prior order : {Prior::membrane, Prior::thinPlate, Prior::triharmonic}) {
    Options options;
    options.prior.kind = order;
    errors.push_back(surfaceError(regularizePoints(points, .06f, options).field, hole));
  }
  // Voxel sides; the hole is 8 wide and its cap 1.1 high. The membrane flattens it, the higher orders follow the
  // curvature.
  EXPECT_LT(errors[0], .3);
  EXPECT_LT(errors[1], .15);
  EXPECT_LT(errors[2], .2);
}

TEST(Regularize, CholeskyGivesMultigridsConvergedField)
{
  const PointSet points = shapes::sample(shapes::sphere(1), 1.2, .15);
  for (const ObservationKind kind : {ObservationKind::points, ObservationKind::plane})
    for (const Prior prior : {Prior::membrane, Prior::thinPlate}) {
      Options options;
      options.observation.kind = kind;
      options.prior.kind = prior;
      options.solver.residualTolerance = 1e-7;
      options.solver.changeTolerance = 0;
      const auto fieldBy = [&](SolverMethod method) {
        options.solver.method = method;
        return regularizePoints(points, .15f, options).field;
      };
      EXPECT_LT(differences(fieldBy(SolverMethod::cholesky), fieldBy(SolverMethod::multigrid)).first, 1e-5)
          << "k = " << order(prior);
    }
}

TEST(Regularize, ConfidenceOfVoxelsIsZeroAwayFromThePoints)
{
  const PointSet points = shapes::sample(shapes::sphere(1), 1.2, .1);
  const DistanceField field = regularizePoints(points, .1f, observingPlanes()).field;
  ASSERT_TRUE(field.hasConfidences());
  shapes::forVoxels(field.lattice().size, [&](int i, int j, int k) {
    const double distance = std::abs(field.lattice().position(i, j, k).norm() - 1);
    if (distance > .1 * 3.5) { // the reach and the curvature between the points
      EXPECT_EQ(field.confidence(i, j, k), 0);
    } else if (distance < .05) {
      EXPECT_GT(field.confidence(i, j, k), .5f);
    }
  });
  EXPECT_LT(field.sampleDistance(Eigen::Vector3f::Zero()), -.5f);
  EXPECT_FALSE(regularizePoints(points, .1f).field.hasConfidences());
}

TEST(Regularize, StartsFromTheInterpolationThatWasAskedFor)
{
  // One sweep of ICM leaves what it starts from in most of the volume.
  Options options = observingPlanes();
  options.solver.method = SolverMethod::icm;
  options.solver.maxIterations = 1;
  options.prior.kind = Prior::membrane;
  const PointSet points = shapes::sample(shapes::sphere(1), 1.2, .1);
  const auto fieldOf = [&](Interpolation interpolation) {
    options.multiscale.interpolation = interpolation;
    return regularizePoints(points, .1f, options).field;
  };
  EXPECT_GT(differences(fieldOf(Interpolation::cubic), fieldOf(Interpolation::linear)).second, .01 * .2)
      << "a hundredth of a voxel";
}

TEST(Regularize, RefusesSurfacesThatNoPointsTellOf)
{
  // A plane through a dozen points, a thousand spacings apart.
  PointSet points;
  for (int n = 0; n < 12; ++n) {
    points.positions.emplace_back(1000.f * static_cast<float>(n % 4), 1000.f * static_cast<float>(n / 4), 0.f);
    points.normals.push_back(Eigen::Vector3f::UnitZ());
  }
  Options options;
  options.multiscale.denseVoxels = 1 << 18;
  const auto refusal = [&](float voxelSize) {
    options.multiscale.voxelSize = voxelSize;
    return clouds::messageOf<ResourceLimit>([&] { regularizePoints(points, 1, options); });
  };
  ASSERT_NE(refusal(2).find("12 points"), std::string::npos) << refusal(2);
  const float fitting = numberAfter("a voxel size of ", refusal(2));
  EXPECT_GT(fitting, 2);
  EXPECT_EQ(refusal(fitting), "");
  // Beside its points the surface takes more memory than they foretell.
  options.multiscale.maxMemory = std::size_t{64} << 20;
  EXPECT_NE(refusal(2).find("along the surface, "), std::string::npos) << refusal(2);
}

TEST(Regularize, SaysWhatIsWrongWhenNothingIsObserved)
{
  Options options = observingPlanes();
  options.observation.maxDistance = 1e-4f;
  EXPECT_THROW(regularizePoints(shapes::sample(shapes::sphere(1), 1.2, .3), .3f, options), InvalidInput);
}
