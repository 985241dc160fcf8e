// SPDX-License-Identifier: BSD-3-Clause
// Every option that --help lists: accepted, in effect, with its default as shown.
#include "support/tool.h"

#include <cmath>
#include <regex>
#include <set>

namespace {

using nlohmann::json;

/// Options whose effect is a value in the report.
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
    {{"--normals", "use"}, "/options/normals/source", "use"},
    {{"--normals", "reference"}, "/vote", "reference"},
    {{"--normals", "estimate"}, "/normalsEstimated", true},
    {{"--normal-radius", "0.5"}, "/options/normals/radius", .5},
    {{"--alone-filter", "off"}, "/options/outliers/alone", false},
    {{"--statistical-filter", "on"}, "/options/outliers/statistical", true, "whole.xyz"},
    {{"--noise-criteria", "on"}, "/options/normals/noiseCriteria", true},
    {{"--orientation-angle", "30"}, "/options/orientation/maxAngle", 30},
    {{"--observation", "median"}, "/options/observation/kind", "median"},
    {{"--observation", "mean"}, "/options/observation/kind", "mean"},
    {{"--observation", "nearest"}, "/options/observation/kind", "nearest"},
    {{"--observation", "trapezoid"}, "/options/observation/kind", "trapezoid"},
    {{"--robust"}, "/options/outliers/robust", true},
    {{"--smoothing", "0.125"}, "/options/observation/smoothing", .125},
    {{"--noise", "0.0625"}, "/options/observation/noise", .0625},
    {{"--noise-model", "none"}, "/options/observation/noiseModel", "none"},
    {{"--noise-model", "constant:.0625"}, "/noise/deviation", .0625},
    {{"--noise-model", "kinect", "--sensor", "0,0,4"}, "/noise/isKnown", true},
    {{"--gradient-weight", "2"}, "/options/observation/gradientWeight", 2},
    {{"--neighbors", "9", "--observation", "plane"}, "/options/observation/neighbors", 9},
    {{"--max-distance", "0.5"}, "/options/observation/maxDistance", .5},
    {{"--prior", "membrane"}, "/options/prior/kind", "membrane"},
    {{"--prior", "thin-plate"}, "/options/prior/kind", "thin-plate"},
    {{"--beta", "0.5", "--observation", "plane"}, "/options/prior/beta", .5},
    {{"--energy", "paper", "--observation", "plane", "--prior", "membrane"}, "/options/prior/energy", "paper"},
    {{"--unit", "nearest"}, "/options/unit", "nearest"},
    {{"--quality", "draft"}, "/options/multiscale/quality", "draft"},
    {{"--quality", "fine"}, "/options/multiscale/quality", "fine"},
    {{"--voxel-size", "0.125"}, "/options/multiscale/voxelSize", .125},
    {{"--padding", "4"}, "/options/multiscale/padding", 4},
    {{"--max-memory", "512"}, "/options/multiscale/maxMemory", 512 << 20},
    {{"--max-memory", "2G"}, "/options/multiscale/maxMemory", std::int64_t{2} << 30},
    {{"--max-memory", "0.5GiB"}, "/options/multiscale/maxMemory", 512 << 20},
    {{"--dense-voxels", "1000"}, "/options/multiscale/denseVoxels", 1000},
    {{"--search", "kdtree"}, "/options/search", "kdtree"},
    {{"--solver", "icm", "--prior", "membrane"}, "/options/solver/method", "icm"},
    {{"--solver", "cg", "--prior", "membrane"}, "/options/solver/method", "cg"},
    {{"--max-iterations", "60"}, "/options/solver/maxIterations", 60},
    {{"--change-tolerance", "0.0078125"}, "/options/solver/changeTolerance", .0078125},
    {{"--seed", "7"}, "/options/solver/seed", 7},
    {{"--remesh", "3"}, "/options/remesher/rounds", 3},
    {{"--no-remesh"}, "/options/remesher/rounds", 0},
    {{"--target-edge", "0.25"}, "/options/remesher/targetEdge", .25},
    {{"--triangles", "900"}, "/options/remesher/triangles", 900},
    {{"--trim", "none"}, "/options/trimming/kind", "none"},
    {{"--trim", "supported"}, "/options/trimming/kind", "supported"},
    {{"--max-hole", "0.5"}, "/options/trimming/maxHole", .5},
    {{"--max-gap", "0.25"}, "/options/trimming/maxGap", .25},
    {{"--watertight"}, "/options/trimming/watertight", true},
    {{"--trim-points", "0"}, "/options/trimming/minComponentPoints", 0},
    {{"--color", "confidence"}, "/options/colors", "confidence"},
    {{"--color", "sigma"}, "/options/colors", "sigma"},
    {{"--uncertainty"}, "/options/uncertainty/compute", true},
    {{"--uncertainty", "--samples", "3"}, "/options/uncertainty/samples", 3},
    {{"--write-samples", "2"}, "/options/uncertainty/surfaces", 2},
    {{"--max-error", "0.5"}, "/options/uncertainty/maxError", .5},
    {{"--color", "none"}, "/options/colors", "none"},
    {{"--threads", "3"}, "/threads", 3},
    {{"--sensor-origin", "off"}, "/options/orientation/sensorOrigin", false},
    {{"--sensor", "0,0,4", "--normals", "estimate"}, "/vote", "sensor", "cap.xyz"},
    {{"--sensor", "-1,0,4", "--sensor", "-.5,0,4", "--normals", "estimate"}, "/vote", "sensor", "cap.xyz"},
    {{"--sensors", "sensors.txt", "--normals", "estimate"}, "/vote", "sensor"},
    {{"--sensors", "sensors.txt", "--views", "views.txt", "--normals", "estimate"}, "/orientation/agreement", 1.0},
    {{"--confidence-field", "column7"}, "/points/zeroConfidence", 100, "trust.xyz"},
};

// Those that the tests below see at work.
const std::set<std::string> testedBelow = {"--help",  "--verbose", "--quiet",      "--report",
                                           "--field", "--picture", "--noise-field"};

// Those that test_tool_files, test_tool_help, test_tool_streams, test_tool_pictures and ranks.sh see at work.
const std::set<std::string> testedElsewhere = {
    "--output-tiles", "--tile-triangles",   "--help-all",     "--manual",        "--bash-completion",
    "--version",      "--output-directory", "--input-format", "--output-format", "--progress",
    "--camera",       "--work-directory",   "--resume"};

class ToolOptions : public tool::Test {
protected:
  ToolOptions()
  {
    write("sphere.xyz", tool::sphereRows(500, .9));
    write("whole.xyz", tool::sphereRows(500)); // no point is far from its neighbors, as those at a rim are
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
    std::vector<std::string> arguments = {input, "mesh.ply"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return reportOf(arguments);
  }
};

std::string joined(const std::vector<std::string>& words)
{
  std::string text;
  for (const std::string& word : words)
    text += word + " ";
  return text;
}

TEST_F(ToolOptions, EachTakesEffect)
{
  const json byDefault = reportWith({});
  for (const Case& c : cases) {
    SCOPED_TRACE(joined(c.arguments));
    const json report = reportWith(c.arguments, c.input);
    const json::json_pointer pointer(c.pointer);
    ASSERT_TRUE(report.contains(pointer));
    EXPECT_EQ(report.at(pointer), c.expected);
    if (c.pointer != "/orientation/agreement" && c.arguments != std::vector<std::string>{"--normals", "use"}) {
      EXPECT_NE(byDefault.at(pointer), c.expected) << "cannot be told from the default";
    }
    EXPECT_GT(report.at("/mesh/triangles"_json_pointer), 100);
  }
}

TEST_F(ToolOptions, HelpListsNothingUntested)
{
  std::set<std::string> tested = testedBelow;
  tested.insert(testedElsewhere.begin(), testedElsewhere.end());
  for (const Case& c : cases)
    for (const std::string& argument : c.arguments)
      if (argument.rfind("--", 0) == 0)
        tested.insert(argument);
  const tool::Outcome outcome = run({"--help-all"});
  EXPECT_EQ(outcome.status, 0);
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
  std::vector<std::string> withField = arguments;
  withField.insert(withField.end(), {"--noise-field", "column7"});
  const json weighed = reportOf(withField);
  EXPECT_EQ(weighed.at("/options/noiseField"_json_pointer), "column7");
  EXPECT_EQ(weighed.at("/noise/isKnown"_json_pointer), true);
  // A hundredth of the weight: by .01 of .04 off the first sphere instead of a half.
  EXPECT_NEAR(together - radiusOf(weighed), .02 - .0004, .003);
}

TEST_F(ToolOptions, VerbosityDecidesWhatIsPrinted)
{
  const tool::Outcome quiet = run({"sphere.xyz", "a.ply", "-q"}), normal = run({"sphere.xyz", "b.ply"}),
                      verbose = run({"sphere.xyz", "c.ply", "--verbose"});
  EXPECT_EQ(quiet.status, 0);
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
