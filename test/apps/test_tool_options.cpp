// SPDX-License-Identifier: BSD-3-Clause
// Every option that --help lists: accepted, in effect, with its default as shown.
#include "reconstruction/command_line.h"
#include "support/tool.h"

#include <pcl/surface/mrf/option_table.h>

#include <cmath>
#include <map>
#include <regex>
#include <set>

namespace {

using nlohmann::json;

/// Options whose effect is a value in the report other than the option itself.
struct Case {
  std::vector<std::string> arguments;
  std::string pointer; ///< into the report
  json expected;
  std::string input = "sphere.xyz";
};

const std::vector<Case> cases = {
    {{"--preset", "paper"}, "/options/solver/method", "icm"},
    {{"--preset", "paper"}, "/normalsEstimated", true},
    {{"--preset", "paper"}, "/options/search", "kdtree"},
    {{"--normals", "reference"}, "/vote", "reference"},
    {{"--normals", "estimate"}, "/normalsEstimated", true},
    {{"--noise-model", "none"}, "/options/observation/noiseModel", "none"},
    {{"--noise-model", "constant:.0625"}, "/noise/deviation", .0625},
    {{"--noise-model", "kinect", "--sensor", "0,0,0"}, "/noise/isKnown", true},
    {{"--no-remesh"}, "/options/remesher/rounds", 0},
    {{"--threads", "3"}, "/threads", 3},
    {{"--sensor", "0,0,4", "--normals", "estimate"}, "/vote", "sensor", "cap.xyz"},
    {{"--sensor", "-1,0,4", "--sensor", "-.5,0,4", "--normals", "estimate"}, "/vote", "sensor", "cap.xyz"},
    {{"--sensors", "sensors.txt", "--normals", "estimate"}, "/vote", "sensor"},
    {{"--sensors", "sensors.txt", "--views", "views.txt", "--normals", "estimate"}, "/orientation/agreement", 1.0},
    {{"--confidence-field", "column7"}, "/points/zeroConfidence", 100, "trust.xyz"},
};

// Options that the tests below use.
const std::set<std::string> testedBelow = {"--help",  "--verbose", "--quiet",      "--report",
                                           "--field", "--picture", "--noise-field"};

// Options that test_tool_files, test_tool_help, test_tool_streams, test_tool_pictures and ranks.sh use.
const std::set<std::string> testedElsewhere = {
    "--output-tiles", "--tile-triangles",   "--help-all",     "--manual",        "--bash-completion",
    "--version",      "--output-directory", "--input-format", "--output-format", "--progress",
    "--camera",       "--work-directory",   "--resume"};

class ToolOptions : public tool::Test {
protected:
  ToolOptions()
  {
    write("sphere.xyz", tool::sphereRows(500, .9));
    write("sensors.txt", "# one in each direction\n0 0 4\n0 0 -4\n4 0 0\n-4 0 0\n0 4 0\n0 -4 0\n");
    std::string views;
    for (const Eigen::Vector3d& point : tool::spherePoints(500, .9)) {
      int axis = 0;
      point.cwiseAbs().maxCoeff(&axis);
      views += std::to_string((axis + 1) % 3 * 2 + (point[axis] < 0 ? 1 : 0)) + "\n";
    }
    write("views.txt", views);
    // What a sensor above sees of the sphere.
    std::string cap;
    for (const Eigen::Vector3d& p : tool::spherePoints(800))
      if (p.z() > .3)
        cap += std::to_string(p.x()) + "," + std::to_string(p.y()) + "," + std::to_string(p.z()) + "\n";
    write("cap.xyz", cap);
    // A sphere, of which nobody trusts a fifth.
    std::string trust;
    int number = 0;
    for (const std::string& row : tool::linesOf(tool::sphereRows(500)))
      trust += row + (number++ % 5 == 0 ? " 0\n" : " 1\n");
    write("trust.xyz", trust);
  }

  json reportWith(const std::vector<std::string>& options, const std::string& input = "sphere.xyz") const
  {
    return reportOf(tool::with({input, "mesh.ply"}, options));
  }
};

TEST(CommandLine, SetsEveryOptionOfTheTable)
{
  using namespace pcl::mrf;
  const auto parsed = [](const std::vector<std::string>& options) {
    const std::vector<std::string> words = tool::with({"tool", "in.ply", "out.ply"}, options);
    std::vector<const char*> pointers;
    for (const std::string& word : words)
      pointers.push_back(word.c_str());
    return mrf_apps::parseCommandLine(static_cast<int>(words.size()), pointers.data()).options;
  };
  const std::set<std::string> flags = {"--robust", "--watertight", "--uncertainty"};
  const std::map<std::string, std::vector<std::string>> givingMeaning = {{"--beta", {"--observation", "plane"}},
                                                                         {"--energy", {"--observation", "plane"}},
                                                                         {"--neighbors", {"--observation", "plane"}},
                                                                         {"--samples", {"--uncertainty"}}};
  for (const OptionDeclaration& option : optionDeclarations()) {
    SCOPED_TRACE(option.flag);
    const double usual = option.get(Options());
    std::vector<std::pair<std::string, double>> values(option.words.begin(), option.words.end());
    if (option.isNumber())
      values = {usual == 7                 ? std::pair("8", 8.)
                : option.range.contains(7) ? std::pair("7", 7.)
                                           : std::pair(".25", .25)};
    if (flags.count(option.flag) > 0)
      values = {{"", 1}};
    for (const auto& [text, value] : values) {
      std::vector<std::string> options = {option.flag + (text.empty() ? "" : "=" + text)};
      if (const auto more = givingMeaning.find(option.flag); more != givingMeaning.end())
        options = tool::with(options, more->second);
      EXPECT_EQ(option.get(parsed(options)), value) << text;
    }
  }
  EXPECT_EQ(parsed({"--max-memory", "2G"}).multiscale.maxMemory, std::int64_t{2} << 30);
  EXPECT_EQ(parsed({"--max-memory", "0.5GiB"}).multiscale.maxMemory, 512 << 20);
  EXPECT_NEAR(static_cast<double>(parsed({"--max-memory", "8GB"}).multiscale.maxMemory), 8e9, 1000); // floats between
}

TEST_F(ToolOptions, EachTakesEffect)
{
  const json byDefault = reportWith({});
  for (const Case& c : cases) {
    SCOPED_TRACE(testing::PrintToString(c.arguments));
    const json report = reportWith(c.arguments, c.input);
    const json::json_pointer pointer(c.pointer);
    ASSERT_TRUE(report.contains(pointer));
    EXPECT_EQ(report.at(pointer), c.expected);
    if (c.pointer != "/orientation/agreement") {
      EXPECT_NE(byDefault.at(pointer), c.expected) << "cannot be told from the default";
    }
    EXPECT_GT(report.at("/mesh/triangles"_json_pointer), 100);
  }
}

TEST_F(ToolOptions, HelpListsNothingUntested)
{
  std::set<std::string> tested = testedBelow;
  tested.insert(testedElsewhere.begin(), testedElsewhere.end());
  for (const pcl::mrf::OptionDeclaration& option : pcl::mrf::optionDeclarations())
    tested.insert(option.flag);
  for (const Case& c : cases)
    for (const std::string& argument : c.arguments)
      if (argument.rfind("--", 0) == 0)
        tested.insert(argument);
  const tool::Outcome outcome = succeed({"--help-all"});
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(tool::optionsListed(outcome.out), tested);
}

TEST_F(ToolOptions, HelpIsTrueAboutDefaults)
{
  const std::string help = std::regex_replace(run({"--help-all"}).out, std::regex("\\s+"), " ");
  const json report = reportWith({});
  EXPECT_NE(
      help.find("--beta WEIGHT weight of the data observed at voxels; lower it for noisy data, [0, 1); default 0.99"),
      std::string::npos);
  EXPECT_NEAR(report.at("/options/prior/beta"_json_pointer), .99, 1e-6); // a float
  EXPECT_NE(help.find("voxel side of the finest level: 3, 2 or 1.5 times s, see --unit; default normal"),
            std::string::npos);
  EXPECT_NEAR(report.at("/options/multiscale/voxelSize"_json_pointer),
              2 * report.at("/density/spacing"_json_pointer).get<double>(), 1e-6);
}

TEST_F(ToolOptions, ExplicitOptionsChangeAPreset)
{
  const json paper = reportWith({"--preset", "paper"});
  // The preset comes first wherever it stands.
  const json changed = reportWith({"--remesh", "2", "--preset", "paper"});
  EXPECT_EQ(changed.at("/options/remesher/rounds"_json_pointer), 2);
  EXPECT_NE(paper.at("/options/remesher/rounds"_json_pointer), 2);
  EXPECT_EQ(changed.at("/options/observation"_json_pointer), paper.at("/options/observation"_json_pointer));
  EXPECT_EQ(changed.at("/options/solver"_json_pointer), paper.at("/options/solver"_json_pointer));
}

TEST_F(ToolOptions, NoiseFieldWeighsThePoints)
{
  // Of two spheres, one a little larger, in between which a surface would run, one is known to be noise.
  std::string rows;
  for (const Eigen::Vector3d& p : tool::spherePoints(500))
    for (const auto& [radius, deviation] : {std::pair<double, double>{1, .01}, {1.04, .1}}) {
      for (int axis = 0; axis < 3; ++axis)
        rows += std::to_string(radius * p[axis]) + " ";
      for (int axis = 0; axis < 3; ++axis)
        rows += std::to_string(p[axis]) + " ";
      rows += std::to_string(deviation) + "\n";
    }
  write("two.xyz", rows);
  const std::vector<std::string> arguments = {"two.xyz", "two.ply", "--voxel-size", "0.15", "--smoothing", "0.15"};
  const auto radiusOf = [](const json& report) {
    return std::cbrt(3 / (4 * M_PI) * report.at("/mesh/volume"_json_pointer).get<double>());
  };
  const double together = radiusOf(reportOf(arguments));
  const json weighed = reportOf(tool::with(arguments, {"--noise-field", "column7"}));
  EXPECT_EQ(weighed.at("/options/noiseField"_json_pointer), "column7");
  EXPECT_EQ(weighed.at("/noise/isKnown"_json_pointer), true);
  // A hundredth of the weight: by .01 of .04 off the first sphere instead of a half.
  EXPECT_NEAR(together - radiusOf(weighed), .02 - .0004, .003);
}

TEST_F(ToolOptions, VerbosityDecidesWhatIsPrinted)
{
  const tool::Outcome quiet = succeed({"sphere.xyz", "a.ply", "-q"}), normal = run({"sphere.xyz", "b.ply"}),
                      verbose = run({"sphere.xyz", "c.ply", "--verbose"});
  EXPECT_EQ(quiet.out + quiet.err, "");
  EXPECT_EQ(normal.status, 0);
  for (const char* heading : {"read ", "used ", "derived ", "seconds ", "surface ", "wrote "})
    EXPECT_NE(normal.out.find(heading), std::string::npos) << heading;
  EXPECT_EQ(normal.out.find("maxIterations"), std::string::npos);
  for (const tool::Outcome& outcome : {run({"cap.xyz", "d.ply", "-v", "--threads", "1"}),
                                       run({"cap.xyz", "e.ply", "-v", "--no-remesh", "--trim", "supported"})}) {
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_FALSE(std::regex_search(outcome.out, std::regex("[ ,]0 [a-z]"))) << "zero counts: " << outcome.out;
    EXPECT_EQ(outcome.out.find("1 threads"), std::string::npos);
  }
  EXPECT_NE(verbose.out.find("maxIterations"), std::string::npos);
  EXPECT_EQ(tool::readText(path("a.ply")), tool::readText(path("c.ply")));
}

} // namespace
