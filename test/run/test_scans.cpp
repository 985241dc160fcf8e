// SPDX-License-Identifier: BSD-3-Clause
// The real scans beside the project, and simulated ones: validity of the meshes; accuracy and hole filling within
// limits.
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
#include <limits>
#include <map>

using namespace pcl::mrf;

namespace {

constexpr double anything = std::numeric_limits<double>::infinity();

struct Outcome {
  Reconstruction reconstruction;
  double clean = 0;    ///< RMS, points without noise to the surface, also dropped ones, % of the diagonal
  double hole = 0;     ///< RMS, held-out points to the surface
  double diagonal = 0; ///< of the scan
};

/// Reconstructs, by default without remeshing: the limits are for the zero level itself.
Outcome run(const std::string& name, Options options, int remeshingRounds = 0)
{
  options.remesher.rounds = remeshingRounds;
  const scans::Scan scan = scans::load(name);
  Outcome outcome;
  outcome.diagonal = scan.diagonal;
  outcome.reconstruction = clouds::reconstruct(scan.points, options, 0);
  const Reconstruction& r = outcome.reconstruction;
  const auto relativeError = [&](std::vector<Eigen::Vector3d> truth) {
    for (Eigen::Vector3d& p : truth)
      p -= r.points.offset;
    return 100 * rootMeanSquare(distancesToMesh(truth, r.mesh)) / scan.diagonal;
  };
  outcome.clean = relativeError(scan.clean);
  outcome.hole = relativeError(scan.heldOut);
  std::cout << name << ": clean " << outcome.clean << ", hole " << outcome.hole << " % of the diagonal; "
            << r.report.mesh.components << " component(s), " << r.report.mesh.triangles << " triangles, "
            << r.report.seconds << " s\n";
  return outcome;
}

/// The outcome with the defaults except the remeshing; computed once for all tests.
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

/// Observations at voxels, with the padding for which the limits were set: three holes say little about a wider volume.
Options voxelwise()
{
  Options options;
  options.observation.kind = ObservationKind::plane;
  options.multiscale.padding = minPadding;
  return options;
}

Options medianThinPlateAndLowBeta()
{
  Options options;
  options.observation.kind = ObservationKind::median;
  options.prior.kind = Prior::thinPlate;
  options.prior.beta = .05f;
  return options;
}

struct Bars {
  std::string scan;
  Options (*options)() = nullptr;           ///< the defaults
  double clean = anything, hole = anything; ///< % of the diagonal
};

class Scan : public testing::TestWithParam<Bars> {
protected:
  void SetUp() override
  {
    if (!scans::available(GetParam().scan))
      GTEST_SKIP() << "there is no " << GetParam().scan;
  }
  void expectBars(const Outcome& outcome) const
  {
    EXPECT_LE(outcome.clean, GetParam().clean);
    EXPECT_LE(outcome.hole, GetParam().hole);
  }
};

class OpenScan : public Scan {};   ///< its last level is in a band; discs of 5 to 10 spacings are withheld
class SmoothScan : public Scan {}; ///< its bars are of remeshed surfaces
class NoisyScan : public Scan {};

std::string nameOf(const testing::TestParamInfo<Bars>& bars)
{
  std::string name = bars.param.scan + "_" + std::to_string(bars.index);
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

} // namespace

TEST_P(Scan, ReachesItsBars)
{
  const auto options = GetParam().options;
  const Outcome outcome = options != nullptr ? run(GetParam().scan, options()) : runAsUsual(GetParam().scan);
  expectOneValidComponent(outcome.reconstruction);
  expectBars(outcome);
}

INSTANTIATE_TEST_SUITE_P(Scans, Scan,
                         testing::Values(Bars{"model", nullptr, .012, .167}, Bars{"igea_clean", nullptr, .0142, .462},
                                         Bars{"nefertiti", nullptr, .0168, .39}, Bars{"bunny", nullptr, .0118, .18},
                                         Bars{"bunny_raw", nullptr, .053, .36}, Bars{"model_noise", nullptr, .088, .62},
                                         Bars{"igea_noise", nullptr, .088, .62}, Bars{"model", voxelwise, .0146, .267},
                                         Bars{"igea_clean", voxelwise, .0155, .56},
                                         Bars{"nefertiti", voxelwise, .0180, .40}, Bars{"bunny", voxelwise, .0130, .24},
                                         Bars{"bunny_raw", voxelwise, .049, .36},
                                         Bars{"model_noise", medianThinPlateAndLowBeta, .083, .32},
                                         Bars{"igea_noise", medianThinPlateAndLowBeta, .115, .45},
                                         Bars{"model", paperPreset}, Bars{"igea_clean", paperPreset}),
                         nameOf);

TEST_P(OpenScan, BandsFillDiscs)
{
  const Outcome& outcome = runAsUsual(GetParam().scan);
  const LevelReport& last = outcome.reconstruction.report.levels.back();
  EXPECT_LT(last.unknowns, last.size.count() / 4);
  expectBars(outcome);
}

INSTANTIATE_TEST_SUITE_P(Clouds, OpenScan,
                         testing::Values(Bars{"model_front", nullptr, .0057, .138},
                                         Bars{"real/dragon_one", nullptr, .0071, .079},
                                         Bars{"real/samp11", nullptr, .128, .39}),
                         nameOf);

TEST_P(SmoothScan, RemeshingKeepsTheSurfaceAndEvensItsTriangles)
{
  const Outcome outcome = run(GetParam().scan, defaultPreset(), RemesherOptions().rounds);
  const Reconstruction& r = outcome.reconstruction;
  expectOneValidComponent(r);
  expectBars(outcome);
  EXPECT_GT(r.report.mesh.meanQuality, .9);
  EXPECT_GT(r.report.mesh.regularShare(), .6);
  EXPECT_LT(r.report.mesh.areaDeviation, r.report.meshBeforeRemeshing.areaDeviation);
  double farthest = 0;
  for (const Eigen::Vector3f& v : r.mesh.vertices)
    farthest = std::max<double>(farthest, std::abs(r.field.sampleDistance(v) / r.field.sampleGradient(v).norm()));
  // .15 of an edge, which is about a voxel, where triangles cut corners. First order exaggerates where the slope of the
  // field is small: .253 was measured at a vertex of nefertiti where it is .38.
  EXPECT_LT(farthest, .3 * r.field.lattice().spacing);
}

INSTANTIATE_TEST_SUITE_P(Scans, SmoothScan,
                         testing::Values(Bars{"model", nullptr, .0115, .167}, Bars{"igea_clean", nullptr, .0115, .462},
                                         Bars{"nefertiti", nullptr, .0138, .39}, Bars{"bunny", nullptr, .0092, .18}),
                         nameOf);

TEST_P(SmoothScan, RobustIsHardlyWorseWhereThereIsNothingToReject)
{
  Options options;
  options.outliers.robust = true;
  EXPECT_LE(run(GetParam().scan, options).clean, 1.05 * runAsUsual(GetParam().scan).clean);
}

TEST_P(SmoothScan, FineIsMoreAccurateThanTheNormalQuality)
{
  Options options;
  options.multiscale.quality = Quality::fine;
  const Outcome fine = run(GetParam().scan, options);
  expectOneValidComponent(fine.reconstruction);
  EXPECT_LE(fine.clean, .85 * runAsUsual(GetParam().scan).clean);
}

/// Expects the zero level of a solution with the default stopping rule to be that of the dense solution, at all
/// vertices, holes included. \param rms, farthest in voxels
void expectDenseSolution(const std::string& scan, Options options, std::int64_t denseVoxels, double rms,
                         double farthest)
{
  const auto fieldOf = [&](std::int64_t voxels, double tolerance) {
    options.multiscale.denseVoxels = voxels;
    options.solver.changeTolerance = tolerance;
    return run(scan, options).reconstruction.field;
  };
  const std::vector<double> offsets = meshes::zeroLevelOffsets(fieldOf(denseVoxels, SolverOptions().changeTolerance),
                                                               fieldOf(std::int64_t{1} << 30, 1e-6));
  const double largest = *std::max_element(offsets.begin(), offsets.end());
  std::cout << scan << ", k = " << order(options.prior.kind) << ": " << rootMeanSquare(offsets) << " voxels RMS, "
            << largest << " at most\n";
  EXPECT_LE(rootMeanSquare(offsets), rms);
  EXPECT_LE(largest, farthest);
}

/// k = 3 comes as close in bands only where there are points: holes differ by up to a voxel.
TEST_P(SmoothScan, ThinPlateInBandsIsThatOfTheDenseSolution)
{
  Options options;
  options.prior.kind = Prior::thinPlate;
  options.multiscale.padding = 6; // one box for both
  // Measured up to .014, .22 at most: they change by half with where the lattice lies.
  expectDenseSolution(GetParam().scan, options, std::int64_t{1} << 18, .017, .25);
}

TEST_P(SmoothScan, DefaultIsTheDenseSolution)
{
  // To the last digit everywhere takes many seconds: all orders on one scan.
  for (const Prior prior : {Prior::triharmonic, Prior::thinPlate, Prior::membrane})
    if (prior == PriorOptions().kind || GetParam().scan == "model") {
      Options options;
      options.prior.kind = prior;
      // Measured up to .052, 1.2 at most, in a hole of nefertiti: as near as is worth its time (method.md, Levels).
      expectDenseSolution(GetParam().scan, options, MultiscaleOptions().denseVoxels, .055, 1.25);
    }
}

TEST_P(NoisyScan, NoiseIsMeasured)
{
  const Outcome& outcome = runAsUsual(GetParam().scan);
  // The scan was made with noise of .25 % of the diagonal; an eighth of that for what quadrics leave of the shape.
  EXPECT_NEAR(100 * outcome.reconstruction.report.noise.deviation / outcome.diagonal, .25, .032);
}

TEST_P(NoisyScan, OnlyFillingsOfItsHolesAreFarFromTheTrueSurface)
{
  const scans::Scan scan = scans::load(GetParam().scan);
  const Reconstruction& r = runAsUsual(GetParam().scan).reconstruction;
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

INSTANTIATE_TEST_SUITE_P(Scans, NoisyScan, testing::Values(Bars{"model_noise"}, Bars{"igea_noise"}), nameOf);
