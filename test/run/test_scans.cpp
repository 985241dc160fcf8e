// SPDX-License-Identifier: BSD-3-Clause
// The real scans beside the project, and a simulated one that is everywhere: validity of the meshes, accuracy and hole
// filling against fixed bars.
#include "field/prior.h"
#include "levels/multiscale.h"
#include "mesh/self_intersection.h"
#include "support/clouds.h"
#include "support/meshes.h"
#include "support/scans.h"
#include "support/shapes.h"

#include <pcl/surface/mrf/reconstruction.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <map>

using namespace pcl::mrf;

namespace {

struct Outcome {
  Reconstruction reconstruction;
  double accuracy = 0; ///< RMS, every input point to the surface, also a dropped one, % of the diagonal
  double clean = 0;    ///< RMS, noise-free points to the surface
  double hole = 0;     ///< RMS, held-out points to the surface
  double diagonal = 0; ///< of the scan
};

/// Reconstructs, by default without remeshing: the bars are on the zero level itself.
Outcome run(const std::string& name, Options options, int remeshingRounds = 0)
{
  options.remesher.rounds = remeshingRounds;
  const scans::Scan scan = scans::load(name);
  Execution execution(0);
  const auto search = makeKdTree();
  Outcome outcome;
  outcome.diagonal = scan.diagonal;
  reconstruct(clouds::raw(scan.points.positions, scan.points.normals), options, *search, execution,
              outcome.reconstruction);

  const Reconstruction& r = outcome.reconstruction;
  const auto relativeError = [&](std::vector<Eigen::Vector3d> truth) {
    for (Eigen::Vector3d& p : truth)
      p -= r.points.offset;
    return 100 * rootMeanSquare(distancesToMesh(truth, r.mesh)) / scan.diagonal;
  };
  std::vector<Eigen::Vector3d> input;
  for (const Eigen::Vector3f& p : scan.points.positions)
    input.push_back(p.cast<double>());
  outcome.accuracy = relativeError(input);
  outcome.clean = relativeError(scan.clean);
  outcome.hole = relativeError(scan.heldOut);
  std::cout << name << ": accuracy " << outcome.accuracy << ", clean " << outcome.clean << ", hole " << outcome.hole
            << " % of the diagonal; " << r.report.mesh.components << " component(s), " << r.report.mesh.triangles
            << " triangles, " << r.report.seconds << " s\n";
  return outcome;
}

/// With the defaults, but for the remeshing; once for all tests.
const Outcome& runAsUsual(const std::string& name)
{
  static std::map<std::string, Outcome> outcomes;
  const auto known = outcomes.find(name);
  return known != outcomes.end() ? known->second : outcomes[name] = run(name, defaultPreset());
}

void expectOneValidComponent(const Reconstruction& reconstruction)
{
  EXPECT_EQ(reconstruction.report.mesh.components, 1);
  meshes::expectSound(reconstruction.report.mesh);
  Execution execution(0);
  EXPECT_TRUE(selfIntersectingTriangles(reconstruction.mesh, execution).empty());
}

struct Bar {
  const char* name;
  double accuracy, hole; ///< % of the diagonal
};

class CleanScan : public testing::TestWithParam<Bar> {
protected:
  void SetUp() override
  {
    if (!scans::available(GetParam().name))
      GTEST_SKIP() << "there is no " << GetParam().name;
  }
};

std::string nameOf(const testing::TestParamInfo<Bar>& bar)
{
  std::string name = bar.param.name;
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

class VoxelwiseScan : public CleanScan {};
class SmoothScan : public CleanScan {}; ///< its bars are of remeshed surfaces
class NoisyScan : public CleanScan {};
class MeasuredCloud : public CleanScan {};
class PaperScan : public CleanScan {}; ///< has no bars

} // namespace

TEST_P(CleanScan, DefaultPresetReachesItsBars)
{
  const Outcome& outcome = runAsUsual(GetParam().name);
  expectOneValidComponent(outcome.reconstruction);
  EXPECT_LE(outcome.accuracy, GetParam().accuracy);
  EXPECT_LE(outcome.hole, GetParam().hole);
}

TEST_P(SmoothScan, RemeshingKeepsTheSurfaceAndEvensItsTriangles)
{
  const Outcome outcome = run(GetParam().name, defaultPreset(), RemesherOptions().rounds);
  const Reconstruction& r = outcome.reconstruction;
  expectOneValidComponent(r);
  EXPECT_GT(r.report.mesh.meanQuality, .9);
  EXPECT_GT(r.report.mesh.regularShare(), .6);
  EXPECT_LT(r.report.mesh.areaDeviation, r.report.meshBeforeRemeshing.areaDeviation);
  EXPECT_LE(outcome.accuracy, GetParam().accuracy);
  EXPECT_LE(outcome.hole, GetParam().hole);
  double farthest = 0;
  for (const Eigen::Vector3f& v : r.mesh.vertices)
    farthest = std::max<double>(farthest, std::abs(r.field.sampleDistance(v) / r.field.sampleGradient(v).norm()));
  // .15 of an edge, which is about a voxel, where triangles cut corners. First order exaggerates where the slope of the
  // field is small: .253 was measured at a vertex of nefertiti where it is .38.
  EXPECT_LT(farthest, .3 * r.field.lattice().spacing);
}

INSTANTIATE_TEST_SUITE_P(Scans, SmoothScan,
                         testing::Values(Bar{"model", .0115, .14}, Bar{"igea_clean", .0115, .46},
                                         Bar{"nefertiti", .0138, .39}, Bar{"bunny", .0092, .18}),
                         nameOf);

INSTANTIATE_TEST_SUITE_P(Scans, CleanScan,
                         testing::Values(Bar{"model", .012, .142}, Bar{"igea_clean", .0142, .46},
                                         Bar{"nefertiti", .0168, .39}, Bar{"bunny", .0118, .18},
                                         Bar{"bunny_raw", .053, .36}),
                         nameOf);

TEST_P(VoxelwiseScan, ReachesItsBars)
{
  Options options;
  options.observation.kind = ObservationKind::plane;
  options.multiscale.padding = minPadding; // the bars were set with it; three holes say little about a wider volume
  const Outcome outcome = run(GetParam().name, options);
  expectOneValidComponent(outcome.reconstruction);
  EXPECT_LE(outcome.accuracy, GetParam().accuracy);
  EXPECT_LE(outcome.hole, GetParam().hole);
}

INSTANTIATE_TEST_SUITE_P(Scans, VoxelwiseScan,
                         testing::Values(Bar{"model", .0146, .245}, Bar{"igea_clean", .0155, .56},
                                         Bar{"nefertiti", .0180, .40}, Bar{"bunny", .0130, .24},
                                         Bar{"bunny_raw", .049, .36}),
                         nameOf);

TEST_P(SmoothScan, RobustIsHardlyWorseWhereThereIsNothingToReject)
{
  Options options;
  options.outliers.robust = true;
  EXPECT_LE(run(GetParam().name, options).clean, 1.05 * runAsUsual(GetParam().name).clean);
}

TEST_P(SmoothScan, FineIsMoreAccurateThanTheNormalQuality)
{
  Options options;
  options.multiscale.quality = Quality::fine;
  const Outcome fine = run(GetParam().name, options);
  expectOneValidComponent(fine.reconstruction);
  EXPECT_LE(fine.accuracy, .85 * runAsUsual(GetParam().name).accuracy);
}

/// From the zero level of the dense solution, in voxels, of one that stops at its default. All vertices count, holes
/// included.
std::vector<double> offsetsFromTheDenseSolution(const std::string& scan, Options options, std::int64_t denseVoxels)
{
  options.remesher.rounds = 0;
  const auto fieldOf = [&](std::int64_t voxels, double tolerance) {
    options.multiscale.denseVoxels = voxels;
    options.solver.changeTolerance = tolerance;
    return run(scan, options).reconstruction.field;
  };
  const DistanceField field = fieldOf(denseVoxels, SolverOptions().changeTolerance);
  const DistanceField dense = fieldOf(1 << 30, 1e-6);
  std::vector<double> offsets = meshes::zeroLevelOffsets(field, dense);
  std::cout << scan << ", k = " << order(options.prior.kind) << ": " << rootMeanSquare(offsets) << " voxels RMS, "
            << *std::max_element(offsets.begin(), offsets.end()) << " at most\n";
  return offsets;
}

/// k = 3 comes as close in bands only where there are points: holes differ by up to a voxel.
TEST_P(SmoothScan, ThinPlateInBandsIsThatOfTheDenseSolution)
{
  Options options = defaultPreset();
  options.prior.kind = Prior::thinPlate;
  options.multiscale.padding = 6; // one box for both
  const std::vector<double> offsets = offsetsFromTheDenseSolution(GetParam().name, options, std::int64_t{1} << 18);
  // Measured up to .014, .22 at most: they change by half with where the lattice lies.
  EXPECT_LE(rootMeanSquare(offsets), .017);
  EXPECT_LE(*std::max_element(offsets.begin(), offsets.end()), .25);
}

TEST_P(SmoothScan, DefaultIsTheDenseSolution)
{
  // To the last digit everywhere takes many seconds: all orders on one scan.
  const bool isFirst = GetParam().name == std::string("model");
  for (const Prior prior : {Prior::triharmonic, Prior::thinPlate, Prior::membrane}) {
    if (prior != PriorOptions().kind && !isFirst)
      continue;
    Options options = defaultPreset();
    options.prior.kind = prior;
    const std::vector<double> offsets =
        offsetsFromTheDenseSolution(GetParam().name, options, MultiscaleOptions().denseVoxels);
    // Measured up to .020, .33 at most, in holes: as near as is worth its time (pointTolerance).
    EXPECT_LE(rootMeanSquare(offsets), .025);
    EXPECT_LE(*std::max_element(offsets.begin(), offsets.end()), .4);
  }
}

/// Open clouds whose last level is in a band: discs of 5 to 10 spacings are withheld.
TEST_P(MeasuredCloud, BandsFillDiscs)
{
  const Outcome& outcome = runAsUsual(GetParam().name);
  EXPECT_LT(outcome.reconstruction.report.levels.back().unknowns,
            outcome.reconstruction.report.levels.back().size.count() / 4);
  EXPECT_LE(outcome.accuracy, GetParam().accuracy);
  EXPECT_LE(outcome.hole, GetParam().hole);
}

INSTANTIATE_TEST_SUITE_P(Clouds, MeasuredCloud,
                         testing::Values(Bar{"model_front", .0057, .138}, Bar{"real/dragon_one", .0071, .079},
                                         Bar{"real/samp11", .128, .39}),
                         nameOf);

TEST_P(NoisyScan, DefaultPresetReachesItsBars)
{
  const Outcome& outcome = runAsUsual(GetParam().name);
  expectOneValidComponent(outcome.reconstruction);
  EXPECT_LE(outcome.clean, .088);
  EXPECT_LE(outcome.hole, .62);
  // The scan was made with noise of .25 % of the diagonal; an eighth of that for the field's own errors, on voxels as
  // coarse as the noise allows.
  EXPECT_NEAR(100 * outcome.reconstruction.report.smoothing.noise / outcome.diagonal, .25, .032);
}

TEST_P(NoisyScan, OnlyFillingsOfItsHolesAreFarFromTheTrueSurface)
{
  const scans::Scan scan = scans::load(GetParam().name);
  const Reconstruction& r = runAsUsual(GetParam().name).reconstruction;
  ASSERT_EQ(r.report.mesh.components, 1);
  const auto searchOf = [&](const std::vector<Eigen::Vector3d>& truth) {
    std::vector<Eigen::Vector3f> positions;
    for (const Eigen::Vector3d& p : truth)
      positions.push_back((p - r.points.offset).cast<float>());
    auto search = makeKdTree();
    search->setPoints(positions);
    return search;
  };
  const auto scanned = searchOf(scan.clean), withheld = searchOf(scan.heldOut);
  Neighbors nearest;
  const auto distance = [&](const NeighborSearch& search, const Eigen::Vector3f& v) {
    search.nearest(v, 1, nearest);
    return 100 * std::sqrt(nearest.squaredDistances.front()) / scan.diagonal;
  };
  // In % of the diagonal. What outliers make lies away from both; a filling may leave the points of its hole, which has
  // a radius of 7 %, by a third of that.
  for (const Eigen::Vector3f& v : r.mesh.vertices)
    if (distance(*scanned, v) > 1) {
      EXPECT_LT(distance(*withheld, v), 7. / 3) << v.transpose();
    }
}

TEST_P(NoisyScan, MedianThinPlateAndLowBetaReachTheBars)
{
  Options options;
  options.observation.kind = ObservationKind::median;
  options.prior.kind = Prior::thinPlate;
  options.prior.beta = .05f;
  const Outcome outcome = run(GetParam().name, options);
  expectOneValidComponent(outcome.reconstruction);
  EXPECT_LE(outcome.clean, GetParam().accuracy);
  EXPECT_LE(outcome.hole, GetParam().hole);
}

INSTANTIATE_TEST_SUITE_P(Scans, NoisyScan, testing::Values(Bar{"model_noise", .083, .32}, Bar{"igea_noise", .115, .45}),
                         nameOf);

TEST_P(PaperScan, PaperPresetGivesOneComponent)
{
  expectOneValidComponent(run(GetParam().name, paperPreset()).reconstruction);
}

INSTANTIATE_TEST_SUITE_P(Scans, PaperScan, testing::Values(Bar{"model", 0, 0}, Bar{"igea_clean", 0, 0}), nameOf);
