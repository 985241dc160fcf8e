// SPDX-License-Identifier: BSD-3-Clause
// Every option of the table: the ends of its range are accepted; values beyond are refused with the option's name and
// value.
#include "levels/multiscale.h"
#include "observation/observation.h"
#include "options/noise_law.h"
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
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

using pcl::mrf::Options;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// The message of a refusal; empty if the value is valid.
template <typename Checked>
std::string refusalOf(const Checked& checked)
{
  return clouds::messageOf<pcl::mrf::InvalidOption>([&] { validate(checked); });
}

/// The message of the stage that an option belongs to, or of the whole options if it belongs to no stage.
std::string refusalOfStage(const std::string& option, const Options& options)
{
  const std::map<std::string, std::function<std::string()>> stages = {
      {"normals", [&] { return refusalOf(options.normals); }},
      {"orientation", [&] { return refusalOf(options.orientation); }},
      {"observation", [&] { return refusalOf(options.observation); }},
      {"prior", [&] { return refusalOf(options.prior); }},
      {"solver", [&] { return refusalOf(options.solver); }},
      {"multiscale", [&] { return refusalOf(options.multiscale); }},
      {"trimming", [&] { return refusalOf(options.trimming); }},
      {"remesher", [&] { return refusalOf(options.remesher); }},
      {"uncertainty", [&] { return refusalOf(options.uncertainty); }}};
  const auto stage = stages.find(option.substr(0, option.find('.')));
  return stage != stages.end() ? stage->second() : refusalOf(options);
}

} // namespace

TEST(OptionTable, EndsOfTheRangesAreAccepted)
{
  for (const pcl::mrf::OptionDeclaration& option : pcl::mrf::optionDeclarations()) {
    SCOPED_TRACE(option.name);
    std::vector<double> ends;
    if (option.isNumber() && !option.range.lowerOpen)
      ends.push_back(option.range.lower);
    if (option.isNumber() && !option.range.upperOpen && std::isfinite(option.range.upper))
      ends.push_back(option.range.upper);
    for (const double end : ends) {
      Options options;
      EXPECT_TRUE(option.accepts(end) && option.set(options, end));
      EXPECT_EQ(refusalOf(options), "");
    }
  }
}

TEST(OptionTable, WhatLiesBeyondIsRefusedByNameByItsStageAsWell)
{
  for (const pcl::mrf::OptionDeclaration& option : pcl::mrf::optionDeclarations()) {
    SCOPED_TRACE(option.name);
    for (const double none : {std::nan(""), infinity, -infinity})
      EXPECT_FALSE(option.accepts(none));
    const bool isUnsigned = std::holds_alternative<std::uint64_t>(option.exact(Options()));
    for (const double wrong : {option.range.lower, option.range.lower - 1, option.range.upper + 1, 99.}) {
      Options options;
      // Not all of it is something that the member can hold; a switch holds nothing that is wrong.
      if (!std::isfinite(wrong) || (isUnsigned && wrong < 0) || option.accepts(wrong) || !option.set(options, wrong) ||
          option.accepts(option.get(options)))
        continue;
      const std::string message = option.name + " = " + pcl::mrf::decimalText(wrong) + " is " + option.refusal();
      EXPECT_EQ(refusalOf(options), message);
      EXPECT_EQ(refusalOfStage(option.name, options), message);
    }
  }
  Options options;
  options.observation.maxDistance = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(refusalOf(options).find("observation.maxDistance = nan is outside its range >= 0"), std::string::npos);
  options = {};
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

/// The preset as its docstring describes it: the differences from the defaults and their consequences.
TEST(Options, ThePapersPresetIsWhatItSays)
{
  using namespace pcl::mrf;
  const Options paper = paperPreset();
  EXPECT_EQ(refusalOf(paper), "");
  std::string differences;
  for (const OptionDeclaration& option : optionDeclarations())
    if (option.get(paper) != option.get(Options()))
      differences += option.name + '=' + option.textOf(option.get(paper)) + ' ';
  EXPECT_EQ(differences,
            "outliers.alone=off normals.source=estimate normals.noiseCriteria=on observation.kind=median "
            "prior.kind=thin-plate prior.beta=0.9 solver.method=icm solver.changeTolerance=0.001 remesher.rounds=10 "
            "trimming.kind=none unit=nearest search=kdtree ");
  EXPECT_FALSE(paper.orientation.joinAcrossCreases);
  EXPECT_EQ(paper.orientation.minComponentShare, .01f);
  EXPECT_EQ(paper.observation.confidenceShape, ConfidenceShape::linear);
  EXPECT_EQ(paper.multiscale.interpolation, Interpolation::linear);
  EXPECT_TRUE(paper.solver.choleskyOnCoarsest);
  EXPECT_FALSE(paper.remesher.fit);

  EXPECT_EQ(paper.observation.neighbors, 5);
  EXPECT_EQ(resolvedRadius(paper.normals, 2), 5) << "2.5 l̄";
  EXPECT_EQ(resolvedMaxDistance(paper.observation, 2, 4), 6) << "3 l̄";
  EXPECT_EQ(spacingsPerVoxel(paper.multiscale.quality), 2);
  SamplingDensity density;
  density.spacing = density.nearestMean = 2;
  density.nearestDeviation = 1;
  EXPECT_EQ(resolvedNeighborDistance(paper.orientation, density), 8) << "l̄ + 6 σ";
  density.nearestDeviation = 0;
  EXPECT_EQ(resolvedNeighborDistance(paper.orientation, density), 5) << "not below 2.5 l̄";
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

TEST(OptionTable, WhatAMemberCannotHoldIsNotSet)
{
  Options options;
  EXPECT_FALSE(pcl::mrf::optionDeclaration("prior.beta").set(options, .999999999)) << "is 1 in single precision";
  EXPECT_FALSE(pcl::mrf::optionDeclaration("observation.maxDistance").set(options, 1e39));
  EXPECT_FALSE(pcl::mrf::optionDeclaration("orientation.maxAngle").set(options, 1e-50)) << "is 0";
  EXPECT_FALSE(pcl::mrf::optionDeclaration("solver.seed").set(options, 1e17)) << "is not the number that was typed";
  EXPECT_EQ(options.prior.beta, Options().prior.beta);
}

/// Members that are not options of the tools are checked as well.
TEST(Options, MembersWithoutARowAreRefusedByName)
{
  const double nan = std::nan("");
  const auto expectRefused = [](auto member, const std::vector<double>& values, const std::string& words) {
    for (const double value : values) {
      Options options;
      member(options) = static_cast<std::decay_t<decltype(member(options))>>(value);
      EXPECT_NE(refusalOf(options).find(words), std::string::npos) << value;
    }
  };
  expectRefused(
      [](Options & o) -> auto& { return o.orientation.neighborDistance; }, {-1, nan, infinity},
      "orientation.neighborDistance = ");
  expectRefused(
      [](Options & o) -> auto& { return o.orientation.minComponentShare; }, {-.1, 1, nan},
      "orientation.minComponentShare = ");
  expectRefused(
      [](Options & o) -> auto& { return o.solver.residualTolerance; }, {-1, 0, 1, nan}, "solver.residualTolerance = ");
  expectRefused(
      [](Options & o) -> auto& { return o.solver.smootherDegree; }, {-1, 51}, "solver.smootherDegree = ");
  expectRefused(
      [](Options & o) -> auto& { return o.observation.confidenceShape; }, {2},
      "observation.confidenceShape = 2 is none of linear, quadratic");
  expectRefused(
      [](Options & o) -> auto& { return o.multiscale.interpolation; }, {2},
      "multiscale.interpolation = 2 is none of cubic, linear");
}

TEST(NoiseLaw, IsNamedWithItsNumbers)
{
  using pcl::mrf::noiseLaw;
  EXPECT_FALSE(noiseLaw("automatic"));
  EXPECT_FALSE(noiseLaw("none"));
  EXPECT_DOUBLE_EQ(noiseLaw("constant:.25")->deviation(3), .25);
  EXPECT_DOUBLE_EQ(noiseLaw("quadratic:.5,.25")->deviation(2), 1.5);
  EXPECT_DOUBLE_EQ(noiseLaw("tof:.5,.25")->deviation(2), 1);
  EXPECT_DOUBLE_EQ(noiseLaw("kinect:.1,40")->deviation(2), .01);
  // As the depth frames' README has it: 4 cm at 4.2 m.
  EXPECT_NEAR(noiseLaw("kinect")->deviation(4.2), .04, .005);
  EXPECT_TRUE(noiseLaw("kinect")->isByRange());
  EXPECT_FALSE(noiseLaw("quadratic:1,0")->isByRange());
}

TEST(NoiseLaw, RefusesWhatIsNone)
{
  for (const char* model : {"", "kinetic", "constant", "constant:", "constant:0", "constant:-1", "constant:1,2",
                            "constant:1 ", "constant:nan", "quadratic:1", "quadratic:1,", "quadratic:0,0", "tof:1,2,3",
                            "kinect:", "kinect:1", "kinect:1,0", "automatic:1", "none:"})
    try {
      pcl::mrf::noiseLaw(model);
      ADD_FAILURE() << model;
    } catch (const pcl::mrf::InvalidOption& error) {
      EXPECT_EQ(error.message().find("observation.noiseModel = " + std::string(model)), 0U) << error.message();
      EXPECT_NE(error.message().find("quadratic:A,B"), std::string::npos) << error.message();
    }
}

TEST(NoiseLaw, NothingIsSaidTwiceOrInVain)
{
  Options options;
  options.observation.noiseModel = "kinect";
  EXPECT_EQ(refusalOf(options), "");
  options.observation.smoothing = .1f;
  EXPECT_EQ(refusalOf(options), "") << "points weigh by their range";
  options.observation.noiseModel = "constant:1";
  EXPECT_NE(refusalOf(options).find("observation.smoothing = 0.1"), std::string::npos);
  options = Options();
  options.observation.noise = 1;
  options.observation.noiseModel = "none";
  EXPECT_EQ(refusalOf(options), "") << "white noise of a known deviation";
  options.observation.noiseModel = "kinect";
  EXPECT_NE(refusalOf(options).find("observation.noise = 1"), std::string::npos);
  options = Options();
  options.observation.kind = pcl::mrf::ObservationKind::mean;
  options.observation.noiseModel = "none";
  EXPECT_NE(refusalOf(options).find("observation.kind"), std::string::npos);
  options.observation.noiseModel = "automatic";
  options.noiseField = "sigma";
  EXPECT_NE(refusalOf(options).find("observation.kind"), std::string::npos);
}

TEST(OptionTable, AtMostFortyTwoOptions)
{
  EXPECT_LE(pcl::mrf::optionDeclarations().size(), 42u);
}

/// Messages name members of the structs, which callers replace by their own names.
TEST(OptionTable, MessagesAreShownInTheWordsOfTheirReaders)
{
  using pcl::mrf::OptionNaming;
  const auto expectShown = [](const char* message, const char* withFlags, const char* withSetters) {
    EXPECT_EQ(withOptionNames(message, OptionNaming::members), message);
    EXPECT_EQ(withOptionNames(message, OptionNaming::flags), withFlags);
    EXPECT_EQ(withOptionNames(message, OptionNaming::setters), withSetters);
  };
  expectShown("prior.beta = 2 is outside its range [0, 1)", "--beta 2 is outside its range [0, 1)",
              "setBeta(2) is outside its range [0, 1)");
  expectShown("5 of 9 stand alone (outliers.alone); allow more (solver.maxIterations).",
              "5 of 9 stand alone (--alone-filter); allow more (--max-iterations).",
              "5 of 9 stand alone (outliers.alone of setOptions); allow more (solver.maxIterations of setOptions).");
  expectShown("give RawCloud::sensors, or colors = sigma: colors of the unit",
              "give --sensor, or --color sigma: colors of the unit",
              "give setSensorPosition, or setColorMode(sigma): colors of the unit");
  expectShown("a.prior.beta, prior.betas and prior.beta.", "a.prior.beta, prior.betas and --beta.",
              "a.prior.beta, prior.betas and setBeta.");
  expectShown("noiseField, observation.noiseModel = tof:1,2 is known", "--noise-field, --noise-model tof:1,2 is known",
              "setNoiseField, setNoiseModel tof:1,2 is known");
  expectShown("", "", "");
}

/// The class has each setter that the table names.
TEST(OptionTable, SettersExist)
{
  std::ifstream file(MRF_SOURCE_DIR "/include/pcl/surface/mrf_reconstruction.h");
  std::ostringstream header;
  header << file.rdbuf();
  for (const pcl::mrf::OptionDeclaration& option : pcl::mrf::optionDeclarations())
    if (!option.setter.empty()) {
      EXPECT_NE(header.str().find(" " + option.setter + "("), std::string::npos) << option.setter;
    }
}
