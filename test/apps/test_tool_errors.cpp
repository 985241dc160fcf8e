// SPDX-License-Identifier: BSD-3-Clause
// Whatever goes wrong: one line on standard error, the right status, and no output.
#include "support/tool.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

namespace {

using testing::TestWithParam;

class ToolErrors : public tool::Test {
protected:
  ToolErrors()
  {
    const std::string rows = tool::sphereRows(400);
    write("sphere.xyz", rows);
  }

  /// The same for a bad input file of this content.
  void expectBadInput(const std::string& name, const std::string& text, const std::string& words) const
  {
    write(name, text);
    expectFailure({name, "out.ply"}, 1, words);
    if (HasFailure())
      return;
    EXPECT_NE(run({name, "out.ply"}).err.find(name), std::string::npos) << "the message does not name the file";
  }
};

const std::string plyHeader = "ply\nformat binary_little_endian 1.0\nelement vertex 400\nproperty float x\n"
                              "property float y\nproperty float z\nend_header\n";
const std::string pcdHeader = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 400\nHEIGHT 1\n"
                              "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 400\nDATA ";
const std::string noise = "It was a dark and stormy night;\nthe rain fell in torrents.\n";
const std::string png = std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\1\0\0\0\1\0", 24) + std::string(300, '\x55');

TEST_F(ToolErrors, MissingAndUnreadableInput)
{
  expectFailure({"nowhere.ply", "out.ply"}, 1, "'nowhere.ply': No such file or directory");
  std::filesystem::create_directory(path("folder.ply"));
  std::filesystem::create_directory(path("folder.obj"));
  expectFailure({"folder.ply", "out.ply"}, 1, "'folder.ply': is a directory");
  expectFailure({"folder.obj", "out.ply"}, 1, "'folder.obj': is a directory");
  chmod(path("sphere.xyz").c_str(), 0);
  if (geteuid() != 0)
    expectFailure({"sphere.xyz", "out.ply"}, 1, "Permission denied");
}

TEST_F(ToolErrors, EmptyNoiseAndWrongType)
{
  for (const char* name : {"bad.ply", "bad.pcd", "bad.obj", "bad.xyz", "bad.txt"}) {
    expectBadInput(name, "", "is empty");
    expectBadInput(name, noise, name);
    expectBadInput(name, png, name);
    expectBadInput(name, "\n\n\n", name);
  }
  expectBadInput("bad.ply", png, "is not a PLY file");
  expectBadInput("bad.pcd", noise, "is not a PCD file");
}

TEST_F(ToolErrors, TruncatedFiles)
{
  expectBadInput("cut.ply", plyHeader + std::string(400 * 12 - 1, '\1'), "truncated");
  expectBadInput("cut.ply", plyHeader + std::string(100, '\1'), "truncated");
  expectBadInput("cut.ply", plyHeader.substr(0, 80), "cut.ply");
  expectBadInput("cut.pcd", pcdHeader + "binary\n" + std::string(400 * 12 - 1, '\1'), "truncated");
  expectBadInput("cut.pcd", pcdHeader + "binary_compressed\n" + std::string(60, '\1'), "truncated");
  expectBadInput("cut.pcd", pcdHeader + "ascii\n1 2 3\n4 5 6\n", "truncated");
  expectBadInput("cut.pcd", pcdHeader.substr(0, 40), "is not a PCD file");
  expectBadInput("cut.xyz", "5\n0 0 0\n1 0 0\n0 1 0\n", "announces 5 points and holds 3");
  expectBadInput("cut.xyz", "0 0 0\n1 0 0\n0 1", "line 3");
  expectBadInput("cut.obj", "v 0 0 0\nv 1 0 0\nv 0 1\n", "line 3");
  expectBadInput("cut.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n", "is not there");
}

TEST_F(ToolErrors, MalformedFiles)
{
  std::string huge = plyHeader;
  huge.replace(huge.find("400"), 3, "4000000000");
  expectBadInput("huge.ply", huge, "truncated");
  huge = pcdHeader;
  huge.replace(huge.find("POINTS 400"), 10, "POINTS 4000000000");
  expectBadInput("huge.pcd", huge + "binary\n", "truncated");
  // Both crash PCL's reader, or what reads its result.
  expectBadInput("headless.pcd", "FIELDS x y z\nDATA ascii\n1 2 3\n", "PCD");
  expectBadInput(
      "sizes.pcd",
      "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\n"
      "DATA binary\n0123456789abc",
      "PCD");
  expectBadInput("words.pcd", pcdHeader + "ascii\n1 2 x\n", "words.pcd");
  expectBadInput("words.xyz", "0 0 0\n1 0 zero\n", "line 2");
  expectBadInput("ragged.xyz", "0 0 0\n1 0 0 5\n", "line 2");
  expectBadInput("flat.ply",
                 "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n",
                 "x, y and z");
}

TEST_F(ToolErrors, TooLittleToReconstruct)
{
  expectBadInput("two.xyz", "0 0 0\n1 0 0\n", "'two.xyz'");
  expectBadInput("three.xyz", "0 0 0\n1 0 0\n0 1 0\n", "'three.xyz'");
  std::string rows;
  for (int i = 0; i < 100; ++i)
    rows += "nan nan nan\n";
  expectBadInput("nan.xyz", rows, "'nan.xyz'");
  rows.clear();
  for (int i = 0; i < 100; ++i)
    rows += "1 2 3\n";
  expectBadInput("one_place.xyz", rows, "'one_place.xyz'");
}

TEST_F(ToolErrors, Usage)
{
  expectFailure({}, 2, "INPUT");
  expectFailure({"sphere.xyz"}, 2, "OUTPUT");
  expectFailure({"sphere.xyz", "a.ply", "b.ply"}, 2,
                "'b.ply' is one argument too many; several inputs take "
                "--output-directory");
  expectFailure({"sphere.xyz", "out.ply", "--nonsense"}, 2, "'--nonsense' is not an option");
  expectFailure({"sphere.xyz", "out.ply", "--nonsense", "3"}, 2, "'--nonsense' is not an option");
  expectFailure({"sphere.xyz", "out.ply", "--beta"}, 2, "--beta needs a value");
  expectFailure({"sphere.xyz", "out.ply", "--beta", ".5", "--beta", ".6"}, 2, "--beta is given more than once");
  expectFailure({"sphere.xyz", "out.doc"}, 2, "does not end in ply, obj, stl, vtk or vtp");
  expectFailure({"sphere.xyz", "out"}, 2, "does not end in");
  expectFailure({"sphere.doc", "out.ply"}, 2, "does not end in pcd, ply, obj, off, xyz, txt, asc or csv");
  expectFailure({"sphere.xyz", "out.ply", "--report", "r.txt"}, 2, ".json");
  expectFailure({"sphere.xyz", "out.ply", "--field", "f.vtk"}, 2, ".vti");
  expectFailure({"sphere.xyz", "out.ply", "--picture", "p.jpg"}, 2, ".png");
}

TEST_F(ToolErrors, BadValues)
{
  const std::vector<std::pair<std::string, std::string>> values = {
      {"--beta", "1"},           {"--beta", "-0.1"},
      {"--beta", "nan"},         {"--beta", "much"},
      {"--beta", "0.5x"},        {"--beta", ""},
      {"--voxel-size", "-1"},    {"--voxel-size", "inf"},
      {"--voxel-size", "9e999"}, {"--voxel-size", "-9e999"},
      {"--neighbors", "0"},      {"--neighbors", "5.5"},
      {"--neighbors", "101"},    {"--remesh", "-1"},
      {"--remesh", "1e9"},       {"--threads", "-2"},
      {"--threads", "5000"},     {"--prior", "flat"},
      {"--observation", "all"},  {"--solver", "magic"},
      {"--normals", "maybe"},    {"--unit", "meters"},
      {"--trim", "much"},        {"--color", "red"},
      {"--preset", "best"},      {"--alone-filter", "yes"},
      {"--sensor", "1,2"},       {"--sensor", "1,2,three"},
      {"--sensor", "1,2,nan"},   {"--orientation-angle", "0"}};
  for (const auto& [option, value] : values)
    expectFailure({"sphere.xyz", "out.ply", option, value}, 2, option);
  // The message says what would be right.
  expectFailure({"sphere.xyz", "out.ply", "--beta", "3"}, 2, "--beta: '3' is outside its range [0, 1)");
  expectFailure({"sphere.xyz", "out.ply", "--beta", "much"}, 2, "'much' is not a number; its range is [0, 1)");
  expectFailure({"sphere.xyz", "out.ply", "--neighbors", "5.5"}, 2, "'5.5' is not a whole number");
  expectFailure({"sphere.xyz", "out.ply", "--padding", "1"}, 2, "'1' is outside its range [2, 100] voxels (0 = ");
  expectFailure({"sphere.xyz", "out.ply", "--color", "gr\ney"}, 2, "'gr?ey' is none of");
  // Single precision has no such numbers: they are infinite, 1, and 0.
  for (const auto& [option, value] : {std::pair<const char*, const char*>{"--max-distance", "1e39"},
                                      {"--beta", ".999999999"},
                                      {"--orientation-angle", "1e-50"},
                                      {"--smoothing", "1e39"},
                                      {"--max-memory", "1e30"}})
    expectFailure({"sphere.xyz", "out.ply", option, value}, 2, std::string(option) + ": '" + value + "'");
  expectFailure({"sphere.xyz", "out.ply", "--prior", "flat"}, 2, "membrane, thin-plate, triharmonic");
  // What the library refuses is called as on the command line.
  expectFailure({"sphere.xyz", "out.ply", "--voxel-size", "100"}, 2, "--voxel-size 100 is larger than the cloud");
}

TEST_F(ToolErrors, ConflictingOptions)
{
  write("sensors.txt", "0 0 3\n");
  write("views.txt", "0\n0\n");
  const std::vector<std::vector<std::string>> conflicts = {{"--remesh", "3", "--no-remesh"},
                                                           {"--sensor", "0,0,3", "--sensors", "sensors.txt"},
                                                           {"--views", "views.txt"},
                                                           {"-v", "-q"},
                                                           {"--trim", "none", "--max-hole", "1"}};
  for (std::vector<std::string> arguments : conflicts) {
    arguments.insert(arguments.begin(), {"sphere.xyz", "out.ply"});
    expectFailure(arguments, 2, "--");
  }
  write("bare.xyz", "0 0 0\n1 0 0\n0 1 0\n");
  expectFailure({"bare.xyz", "out.ply", "--normals", "use"}, 2, "has no normals");
  expectFailure({"bare.xyz", "out.ply", "--normals", "reference"}, 2, "has no normals");
  expectFailure({"sphere.xyz", "out.ply", "--confidence-field", "trust"}, 2, "'trust'");
}

TEST_F(ToolErrors, SensorFiles)
{
  const std::vector<std::string> base = {"sphere.xyz", "out.ply", "--sensors", "sensors.txt"};
  const auto withViews = [&] {
    std::vector<std::string> arguments = base;
    arguments.insert(arguments.end(), {"--views", "views.txt"});
    return arguments;
  };
  expectFailure(base, 1, "'sensors.txt': No such file");
  write("sensors.txt", "0 0 3\n0 0\n");
  expectFailure(base, 1, "'sensors.txt': line 2");
  write("sensors.txt", "# none\n");
  expectFailure(base, 1, "holds no sensor positions");
  write("sensors.txt", "0 0 3\n");
  write("views.txt", "0\n0\n");
  expectFailure(withViews(), 1, "2 views for 400 points");
  std::string views;
  for (int i = 0; i < 400; ++i)
    views += "1\n";
  write("views.txt", views);
  expectFailure(withViews(), 1, "names sensor 1");
  write("views.txt", "0.5\n");
  expectFailure(withViews(), 1, "'views.txt': line 1");
}

TEST_F(ToolErrors, OutputsAreCheckedBeforeTheWork)
{
  std::filesystem::create_directory(path("folder.ply"));
  expectFailure({"sphere.xyz", "nowhere/out.ply"}, 1, "'nowhere/out.ply': cannot be written");
  expectFailure({"sphere.xyz", "folder.ply"}, 1, "'folder.ply': is a directory");
  expectFailure({"sphere.xyz", "out.ply", "--report", "nowhere/r.json"}, 1, "nowhere/r.json");
  expectFailure({"sphere.xyz", "out.ply", "--field", "nowhere/f.vti"}, 1, "nowhere/f.vti");
  // Without reading the input, which would fail as well.
  expectFailure({"absent.xyz", "nowhere/out.ply"}, 1, "nowhere/out.ply");
  std::filesystem::create_symlink("/dev/null", path("null.ply"));
  expectFailure({"sphere.xyz", "null.ply"}, 1, "is not a regular file");
  write("sphere.ply", "kept");
  expectFailure({"sphere.ply", "sphere.ply"}, 2, "would be overwritten");
  std::filesystem::create_hard_link(path("sphere.ply"), path("link.ply"));
  expectFailure({"sphere.ply", "link.ply"}, 2, "would be overwritten");
  expectFailure({"sphere.ply", "./sphere.ply"}, 2, "would be overwritten");
  EXPECT_EQ(tool::readText(path("sphere.ply")), "kept");
  if (geteuid() != 0) {
    std::filesystem::create_directory(path("closed"));
    chmod(path("closed").c_str(), 0500);
    expectFailure({"sphere.xyz", "closed/out.ply"}, 1, "Permission denied");
  }
}

TEST_F(ToolErrors, AnExistingOutputSurvivesAFailure)
{
  write("out.ply", "earlier result");
  write("two.xyz", "0 0 0\n1 0 0\n");
  expectFailure({"two.xyz", "out.ply"}, 1, "two.xyz");
  EXPECT_EQ(tool::readText(path("out.ply")), "earlier result");
}

TEST_F(ToolErrors, PictureNeedsADisplay)
{
  expectFailure({"sphere.xyz", "out.ply", "--picture", "p.png"}, 1, "xvfb-run");
  // A display that does not answer.
  const tool::Outcome outcome = tool::runProgram(
      {"env", "DISPLAY=:9753", MRF_TOOL, "sphere.xyz", "out.ply", "--picture", "p.png"}, path(""), true);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("xvfb-run"), std::string::npos) << outcome.err;
  EXPECT_EQ(files(), std::vector<std::string>{"sphere.xyz"});
}

TEST_F(ToolErrors, MethodFailures)
{
  expectFailure({"sphere.xyz", "out.ply", "--voxel-size", "0.001", "--max-memory", "16"}, 3, "voxel");
  // The sphere's box has a diagonal of 2√3.
  expectFailure({"sphere.xyz", "out.ply", "--voxel-size", "3.5"}, 2, "larger than the cloud");
  expectFailure({"sphere.xyz", "out.ply", "--voxel-size", "1e9"}, 2, "larger than the cloud");
}

} // namespace
