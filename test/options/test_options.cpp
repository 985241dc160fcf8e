// SPDX-License-Identifier: BSD-3-Clause
// Every option's limits: the ends of its range are accepted, what lies beyond is refused with the option's name and
// value.
#include "field/prior.h"
#include "levels/multiscale.h"
#include "observation/observation.h"
#include "options/validation.h"
#include "orientation/orientation.h"
#include "points/normals.h"
#include "support/clouds.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/option_table.h>
#include <pcl/surface/mrf/options.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

using pcl::mrf::Options;

namespace {

struct Limit {
  std::string name;
  std::function<void(Options&, double)> set;
  std::vector<double> allowed, refused;
};

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

template <typename Stage, typename Value>
Limit limit(const char* name, Stage Options::*stage, Value Stage::*value, std::vector<double> allowed,
            std::vector<double> refused)
{
  if (std::is_floating_point<Value>::value)
    refused.insert(refused.end(), {nan, infinity, -infinity});
  return {name, [=](Options& options, double x) { options.*stage.*value = static_cast<Value>(x); }, std::move(allowed),
          std::move(refused)};
}

std::vector<Limit> limits()
{
  using namespace pcl::mrf;
  const auto outliers = &Options::outliers;
  const auto normals = &Options::normals;
  const auto orientation = &Options::orientation;
  const auto observation = &Options::observation;
  const auto prior = &Options::prior;
  const auto solver = &Options::solver;
  const auto multiscale = &Options::multiscale;
  const auto trimming = &Options::trimming;
  const auto remesher = &Options::remesher;
  return {
      limit("spacingNeighbors", outliers, &OutlierOptions::spacingNeighbors, {1, 1000}, {0, -1, 1001}),
      limit("spacingFactor", outliers, &OutlierOptions::spacingFactor, {1.001, 100}, {1, 0, -3}),
      limit("statisticalNeighbors", outliers, &OutlierOptions::statisticalNeighbors, {1, 1000}, {0, -1, 1001}),
      limit("statisticalDeviations", outliers, &OutlierOptions::statisticalDeviations, {.001, 10}, {0, -1}),
      limit("radius", normals, &NormalOptions::radius, {0, 1}, {-1}),
      limit("maxThirdEigenvalue", normals, &NormalOptions::maxThirdEigenvalue, {.001, 1. / 3}, {0, -.1, .34}),
      limit("maxPlaneDistance", normals, &NormalOptions::maxPlaneDistance, {0, 1}, {-1}),
      limit("neighborDistance", orientation, &OrientationOptions::neighborDistance, {0, 1}, {-1}),
      limit("maxAngle", orientation, &OrientationOptions::maxAngle, {.001, 90}, {0, -1, 90.1}),
      limit("minComponentShare", orientation, &OrientationOptions::minComponentShare, {0, .999}, {-.1, 1}),
      limit("lowAgreement", orientation, &OrientationOptions::lowAgreement, {0, 1}, {-.1, 1.1}),
      limit("neighbors", observation, &ObservationOptions::neighbors, {1, 100}, {0, -1, 101}),
      limit("maxDistance", observation, &ObservationOptions::maxDistance, {0, 1}, {-1}),
      limit("smoothing", observation, &ObservationOptions::smoothing, {0, 1}, {-1}),
      limit("noise", observation, &ObservationOptions::noise, {0, 1}, {-1}),
      limit("gradientWeight", observation, &ObservationOptions::gradientWeight, {0, .001, 100}, {-1, 101}),
      limit("beta", prior, &PriorOptions::beta, {0, .999999}, {-.1, 1, 2}),
      limit("maxIterations", solver, &SolverOptions::maxIterations, {0, 1000000}, {-1}),
      limit("residualTolerance", solver, &SolverOptions::residualTolerance, {1e-12, .999}, {0, -1, 1}),
      limit("changeTolerance", solver, &SolverOptions::changeTolerance, {0, 1}, {-1}),
      limit("smootherDegree", solver, &SolverOptions::smootherDegree, {0, 50}, {-1, 51}),
      limit("voxelSize", multiscale, &MultiscaleOptions::voxelSize, {0, 1}, {-1}),
      limit("padding", multiscale, &MultiscaleOptions::padding, {2, 100}, {1, -1, 101}),
      limit("coarsestSide", multiscale, &MultiscaleOptions::coarsestSide, {4, 256}, {3, -1, 257}),
      limit("denseVoxels", multiscale, &MultiscaleOptions::denseVoxels, {0, 1 << 30}, {-1}),
      limit("maxHole", trimming, &TrimmingOptions::maxHole, {0, 1}, {-1}),
      limit("maxGap", trimming, &TrimmingOptions::maxGap, {0, 1}, {-1}),
      limit("minComponentPoints", trimming, &TrimmingOptions::minComponentPoints, {0, 1000000}, {-1, 1000001}),
      limit("minComponentShare", trimming, &TrimmingOptions::minComponentShare, {0, .999}, {-.1, 1}),
      limit("rounds", remesher, &RemesherOptions::rounds, {0, 1000}, {-1, 1001}),
      limit("targetEdge", remesher, &RemesherOptions::targetEdge, {0, 1}, {-1}),
      limit("relaxation", remesher, &RemesherOptions::relaxation, {.001, 1}, {0, -.1, 1.1}),
      limit("samples", &Options::uncertainty, &UncertaintyOptions::samples, {2, 1000}, {1, 0, -1, 1001}),
      limit("surfaces", &Options::uncertainty, &UncertaintyOptions::surfaces, {0, 1000}, {-1, 1001}),
      limit("maxError", &Options::uncertainty, &UncertaintyOptions::maxError, {0, 1}, {-1}),
      {"threads", [](Options& options, double x) { options.threads = static_cast<int>(x); }, {0, 1024}, {-1, 1025}},
  };
}

} // namespace

TEST(Options, EndsOfTheRangesAreAccepted)
{
  for (const Limit& limit : limits())
    for (const double value : limit.allowed) {
      Options options;
      limit.set(options, value);
      EXPECT_NO_THROW(validate(options)) << limit.name << " = " << value;
    }
}

TEST(Options, ValuesBeyondThemAreRefusedByName)
{
  for (const Limit& limit : limits())
    for (const double value : limit.refused) {
      Options options;
      limit.set(options, value);
      try {
        validate(options);
        ADD_FAILURE() << limit.name << " = " << value << " was accepted";
      } catch (const pcl::mrf::InvalidOption& error) {
        EXPECT_NE(error.message().find(limit.name), std::string::npos) << error.message();
        EXPECT_EQ(error.status(), pcl::mrf::Status::invalidOption);
      }
    }
}

TEST(Options, StagesRefuseInTheSameWords)
{
  Options options;
  const auto expectSame = [&](const auto& stage, const std::string& message) {
    EXPECT_EQ(clouds::messageOf<pcl::mrf::InvalidOption>([&] { validate(stage); }), message);
    EXPECT_EQ(clouds::messageOf<pcl::mrf::InvalidOption>([&] { validate(options); }), message);
    options = Options();
  };
  options.prior.beta = 1.5f;
  expectSame(options.prior, "prior.beta = 1.5 is outside its range [0, 1)");
  options.solver.smootherDegree = 51;
  expectSame(options.solver,
             "solver.smootherDegree = 51 is " + pcl::mrf::optionDeclaration("solver.smootherDegree").refusal());
  options.multiscale.coarsestSide = 3;
  expectSame(options.multiscale, "multiscale.coarsestSide = 3 is outside its range [4, 256] voxels");
  options.prior.energy = static_cast<pcl::mrf::Energy>(9);
  expectSame(options.prior, "prior.energy = 9 is none of joint, paper");
}

/// What the docstring of paperPreset() says, setting by setting.
TEST(Options, ThePapersPresetIsWhatItSays)
{
  using namespace pcl::mrf;
  const Options paper = paperPreset();
  EXPECT_EQ(paper.unit, LengthUnit::nearest);

  EXPECT_EQ(paper.normals.source, NormalSource::estimate);
  EXPECT_TRUE(paper.normals.noiseCriteria);
  EXPECT_EQ(resolvedRadius(paper.normals, 2), 5) << "2.5 l̄";
  EXPECT_EQ(paper.normals.maxThirdEigenvalue, .1f);
  EXPECT_EQ(paper.normals.maxPlaneDistance, 0) << "l̄";
  for (const bool isOn :
       {paper.outliers.alone, paper.outliers.spacing, paper.outliers.statistical, paper.outliers.robust})
    EXPECT_FALSE(isOn) << "the paper has no filter but its noise criteria";
  EXPECT_FALSE(paper.orientation.joinAcrossCreases);
  EXPECT_EQ(paper.orientation.maxAngle, 15);
  EXPECT_EQ(paper.orientation.minComponentShare, .01f);
  SamplingDensity density;
  density.spacing = density.nearestMean = 2;
  density.nearestDeviation = 1;
  EXPECT_EQ(resolvedNeighborDistance(paper.orientation, density), 8) << "l̄ + 6 σ";
  density.nearestDeviation = 0;
  EXPECT_EQ(resolvedNeighborDistance(paper.orientation, density), 5) << "not below 2.5 l̄";

  EXPECT_EQ(paper.observation.kind, ObservationKind::median);
  EXPECT_EQ(paper.observation.neighbors, 5);
  EXPECT_EQ(paper.observation.confidenceShape, ConfidenceShape::linear);
  EXPECT_EQ(resolvedMaxDistance(paper.observation, 2, 2 * spacingsPerVoxel(paper.multiscale.quality)), 6) << "3 l̄";
  EXPECT_TRUE(paper.observation.scaleWithLevel);

  EXPECT_EQ(paper.prior.kind, Prior::thinPlate);
  EXPECT_EQ(paper.prior.beta, .9f);
  EXPECT_EQ(paper.prior.energy, Energy::joint);

  EXPECT_EQ(paper.solver.method, SolverMethod::icm);
  EXPECT_TRUE(paper.solver.choleskyOnCoarsest);
  EXPECT_EQ(paper.solver.changeTolerance, 1e-3);
  EXPECT_EQ(paper.solver.maxIterations, 0) << "1000 sweeps";
  EXPECT_EQ(paper.multiscale.interpolation, Interpolation::linear);
  EXPECT_EQ(paper.multiscale.padding, 0) << "room beside openings";
  EXPECT_EQ(paper.search, SearchKind::kdTree);
  EXPECT_EQ(paper.multiscale.coarsestSide, 16);
  EXPECT_EQ(paper.multiscale.voxelSize, 0);
  EXPECT_EQ(spacingsPerVoxel(paper.multiscale.quality), 2);

  EXPECT_EQ(paper.trimming.kind, Trimming::none);
  EXPECT_EQ(paper.remesher.rounds, 10);
  EXPECT_FALSE(paper.remesher.fit);
}

/// The message of a refusal; empty: the options are valid.
std::string refusalOf(const Options& options)
{
  try {
    validate(options);
    return {};
  } catch (const pcl::mrf::InvalidOption& error) {
    return error.message();
  }
}

TEST(OptionTable, EveryMemberIsThereOnce)
{
  const auto& table = pcl::mrf::optionDeclarations();
  std::set<std::string> names, flags;
  for (const pcl::mrf::OptionDeclaration& option : table) {
    EXPECT_TRUE(names.insert(option.name).second) << option.name;
    EXPECT_TRUE(flags.insert(option.flag).second) << option.flag;
    EXPECT_EQ(option.flag.rfind("--", 0), 0u) << option.flag;
    EXPECT_FALSE(option.help.empty()) << option.name;
    EXPECT_EQ(option.isNumber(), !option.unit.empty()) << option.name;
    EXPECT_EQ(&pcl::mrf::optionDeclaration(option.name), &option);
  }
  for (const Limit& limit : limits())
    EXPECT_TRUE(std::any_of(names.begin(), names.end(), [&](const std::string& name) {
      return name == limit.name || name.substr(name.find('.') + 1) == limit.name;
    })) << limit.name;
  EXPECT_THROW(pcl::mrf::optionDeclaration("prior.gamma"), std::out_of_range);
}

TEST(OptionTable, ReadsWhatItSets)
{
  for (const pcl::mrf::OptionDeclaration& option : pcl::mrf::optionDeclarations()) {
    SCOPED_TRACE(option.name);
    std::vector<double> values;
    for (const auto& word : option.words)
      values.push_back(word.second);
    if (option.isNumber()) {
      const double lower = option.range.lower, width = std::min(option.range.upper, lower + 8) - lower;
      values = {lower + .25 * width, lower + .75 * width};
      if (option.isWhole)
        values = {lower + 1, lower + 2};
    }
    for (const double value : values) {
      Options options;
      ASSERT_TRUE(option.accepts(value)) << value;
      ASSERT_TRUE(option.set(options, value)) << value;
      EXPECT_FLOAT_EQ(static_cast<float>(option.get(options)), static_cast<float>(value));
      EXPECT_EQ(refusalOf(options), "");
      // No other member than this.
      for (const pcl::mrf::OptionDeclaration& other : pcl::mrf::optionDeclarations())
        if (&other != &option) {
          EXPECT_EQ(other.get(options), other.get(Options())) << other.name;
        }
    }
  }
}

TEST(OptionTable, RefusalsHaveOneForm)
{
  for (const pcl::mrf::OptionDeclaration& option : pcl::mrf::optionDeclarations()) {
    SCOPED_TRACE(option.name);
    if (option.isNumber()) {
      // Beyond each end that the member's type can hold.
      const double wrong = std::isfinite(option.range.upper) ? option.range.upper + 1 : option.range.lower;
      if (option.accepts(wrong))
        continue;
      Options options;
      ASSERT_TRUE(option.set(options, wrong) || option.range.upperOpen || option.range.lowerOpen);
      if (option.get(options) == wrong) {
        EXPECT_EQ(refusalOf(options), option.name + " = " + pcl::mrf::decimalText(wrong) + " is outside its range " +
                                          option.refusal().substr(std::string("outside its range ").size()));
      }
      continue;
    }
    EXPECT_EQ(option.refusal().rfind("none of ", 0), 0u);
    for (const auto& word : option.words)
      EXPECT_NE(option.refusal().find(word.first), std::string::npos);
  }
  Options options;
  options.prior.kind = static_cast<pcl::mrf::Prior>(7);
  EXPECT_EQ(refusalOf(options), "prior.kind = 7 is none of membrane, thin-plate, triharmonic");
  options = {};
  options.multiscale.padding = 1;
  EXPECT_EQ(refusalOf(options),
            "multiscale.padding = 1 is outside its range [2, 100] voxels (0 = 6, more beside openings)");
  options = {};
  options.prior.beta = 1;
  EXPECT_EQ(refusalOf(options), "prior.beta = 1 is outside its range [0, 1)");
}

TEST(OptionTable, WhatAMemberCannotHoldIsNotSet)
{
  Options options;
  EXPECT_FALSE(pcl::mrf::optionDeclaration("prior.beta").set(options, .999999999)) << "is 1 in single precision";
  EXPECT_FALSE(pcl::mrf::optionDeclaration("observation.maxDistance").set(options, 1e39));
  EXPECT_FALSE(pcl::mrf::optionDeclaration("remesher.relaxation").set(options, 1e-50)) << "is 0";
  EXPECT_FALSE(pcl::mrf::optionDeclaration("solver.seed").set(options, 1e17)) << "is not the number that was typed";
  EXPECT_EQ(options.prior.beta, Options().prior.beta);
}

TEST(Options, PresetsAreValid)
{
  EXPECT_NO_THROW(validate(pcl::mrf::defaultPreset()));
  EXPECT_NO_THROW(validate(pcl::mrf::paperPreset()));
}
