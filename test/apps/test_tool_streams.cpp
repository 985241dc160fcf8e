// SPDX-License-Identifier: BSD-3-Clause
// Standard input and output, several inputs, progress, and what is left behind: whole files or none, whatever ends the
// run.
#include "support/tool.h"

#include <pcl/io/ply_io.h>

#include <algorithm>
#include <csignal>
#include <sstream>

namespace {

class ToolStreams : public tool::Test {
protected:
  ToolStreams()
  {
    rows_ = tool::sphereRows(400);
    write("sphere.xyz", rows_);
  }

  /// Runs a line of the shell in the folder, without descriptors but the first three; the tool is $TOOL.
  tool::Outcome shell(const std::string& line) const
  {
    return tool::runProgram({"sh", "-c", "exec 3>&- 4>&-; TOOL='" MRF_TOOL "'; " + line}, path(""), false);
  }

  /// Names of the files but for those of the test.
  std::vector<std::string> results() const
  {
    std::vector<std::string> names = files();
    names.erase(std::remove_if(names.begin(), names.end(),
                               [](const std::string& name) { return name == "sphere.xyz" || name == "large.xyz"; }),
                names.end());
    return names;
  }

  std::string rows_;
};

TEST_F(ToolStreams, StandardInputIsReadByWhatItBeginsWith)
{
  succeed({"sphere.xyz", "expected.ply", "-q"});
  write("off", "NOFF\n400 0 0\n" + rows_);
  // What is packed is known as well; a format that is said is not guessed.
  for (const char* line :
       {"cat off | $TOOL - out.ply -q", "gzip -c off | $TOOL - out.ply -q",
        "$TOOL - out.ply -q --input-format txt < sphere.xyz", "$TOOL off out.ply -q --input-format off"}) {
    SCOPED_TRACE(line);
    const tool::Outcome outcome = shell(line);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(tool::readText(path("out.ply")), tool::readText(path("expected.ply")));
    std::filesystem::remove(path("out.ply"));
  }
}

TEST_F(ToolStreams, StandardInputThatIsNoCloudIsTold)
{
  const auto expect = [&](const std::string& line, int status, const std::string& words) {
    SCOPED_TRACE(line);
    const tool::Outcome outcome = shell(line);
    EXPECT_EQ(outcome.status, status);
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(files(), std::vector<std::string>{"sphere.xyz"});
  };
  expect("echo It was a dark and stormy night | $TOOL - out.ply", 1,
         "'standard input': looks like none of pcd, ply, obj, off, xyz, txt, asc, csv, tsv, dat, pts, ptx or las, also "
         "with .gz; "
         "say --input-format");
  expect("$TOOL - out.ply < /dev/null", 1, "'standard input': is empty");
  expect("echo 1 2 3 | $TOOL - out.ply", 1, "'standard input': at least 4 points are needed; 1 of 1 are left");
  expect("$TOOL - out.ply --input-format ply < sphere.xyz", 1,
         "'standard input': is read as ply and begins as xyz does: say --input-format xyz");
  expect("$TOOL sphere.xyz -", 2, "standard output, which has no name to tell the format; say --output-format");
  expect("$TOOL sphere.xyz - --output-format doc", 2, "'doc' is none of ply, obj, stl, vtk, vtp, glb, dae, 3mf");
  expect("$TOOL sphere.xyz /dev/stdout --output-format ply | cat; exit 1", 1,
         "'/dev/stdout': is no file; standard output is called -");
  expect("$TOOL - --output-directory out < sphere.xyz", 2, "standard input has no name");
}

TEST_F(ToolStreams, StandardOutputHoldsTheMeshAlone)
{
  for (const std::string format : {"ply", "obj", "stl", "vtk", "vtp", "glb"}) {
    SCOPED_TRACE(format);
    succeed({"sphere.xyz", "out." + format, "-q"});
    const tool::Outcome outcome = succeed({"sphere.xyz", "-", "--output-format", format, "-v", "--report", "r.json"});
    EXPECT_EQ(outcome.out, tool::readText(path("out." + format)));
    EXPECT_NE(outcome.err.find("wrote     standard output ("), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("surface"), std::string::npos);
  }
  EXPECT_EQ(shell("$TOOL - - --output-format ply -q < sphere.xyz | cmp - out.ply").status, 0);
}

TEST_F(ToolStreams, AStandardOutputThatIsClosedIsAFailure)
{
  const tool::Outcome outcome = shell("{ $TOOL sphere.xyz - --output-format obj -q; echo $? > status; } | true; "
                                      "$TOOL sphere.xyz - --output-format ply -q > /dev/full");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("'standard output': cannot be written: No space left"), std::string::npos) << outcome.err;
}

TEST_F(ToolStreams, EachInputBecomesAFileInTheFolder)
{
  write("two.xyz", "0 0 0\n1 0 0\n");
  std::filesystem::create_directory(path("scans"));
  write("scans/half.xyz", tool::sphereRows(400, .5));
  const tool::Outcome outcome = run({"sphere.xyz", "two.xyz", "nowhere.ply", "scans/half.xyz", "--output-directory",
                                     "a/meshes", "--output-format", "obj", "--report", "r.json"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(files("a/meshes"), (std::vector<std::string>{"half-r.json", "half.obj", "nowhere-r.json", "sphere-r.json",
                                                         "sphere.obj", "two-r.json"}))
      << "a failure leaves its report alone";
  // A line for each.
  EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 2) << outcome.out;
  EXPECT_NE(outcome.out.find("sphere.xyz -> a/meshes/sphere.obj: 400 points, "), std::string::npos) << outcome.out;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 2) << outcome.err;
  for (const char* words :
       {"pcl_mrf_reconstruction: 'two.xyz': at least 4 points are needed; 2 of 2", "'nowhere.ply': No such file"})
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  // The same bytes as one at a time.
  succeed({"sphere.xyz", "alone.obj", "-q"});
  EXPECT_EQ(tool::readText(path("alone.obj")), tool::readText(path("a/meshes/sphere.obj")));

  // The first failure decides on the status, and every line names its input.
  const tool::Outcome large =
      run({"sphere.xyz", "nowhere.ply", "--output-directory", "out", "--voxel-size", ".001", "--max-memory", "16"});
  EXPECT_EQ(large.status, 3);
  EXPECT_EQ(large.err.rfind("pcl_mrf_reconstruction: 'sphere.xyz': ", 0), 0u) << large.err;
}

TEST_F(ToolStreams, AFolderOfOutputsIsCheckedBeforeTheWork)
{
  std::filesystem::create_directory(path("scans"));
  write("scans/sphere.xyz", rows_);
  expectFailure({"sphere.xyz", "scans/sphere.xyz", "--output-directory", "out"}, 2,
                "'sphere.xyz' and 'scans/sphere.xyz' would both become 'out/sphere.ply'");
  expectFailure({"sphere.xyz", "--output-directory", "out", "--report", "a/r.json"}, 2, "--report: 'a/r.json'");
  expectFailure({"--output-directory", "out"}, 2, "INPUT");
  expectFailure({"sphere.xyz", "--output-directory", "sphere.xyz"}, 1, "'sphere.xyz'");
  expectFailure({"sphere.xyz", "other.doc", "--output-directory", "out"}, 2, "other.doc");
}

/// The percentages and the stages that --progress printed.
struct Told {
  std::vector<int> percentages;
  std::vector<std::string> stages;

  explicit Told(const std::string& text)
  {
    for (const std::string& line : tool::linesOf(text)) {
      std::istringstream words(line);
      int percent = -1;
      std::string sign, seconds, unit, stage;
      words >> percent >> sign >> seconds >> unit >> std::ws;
      std::getline(words, stage);
      EXPECT_EQ(sign + unit, "%s") << line;
      percentages.push_back(percent);
      stages.push_back(stage);
    }
  }
};

TEST_F(ToolStreams, ProgressIsToldWhereItIsAskedFor)
{
  EXPECT_EQ(run({"sphere.xyz", "out.ply"}).err, "") << "standard error is no terminal";
  const tool::Outcome outcome = succeed({"sphere.xyz", "out.ply", "--progress", "-q"});
  EXPECT_EQ(outcome.out, "");
  const Told told(outcome.err);
  ASSERT_GE(told.stages.size(), 8u) << outcome.err;
  EXPECT_EQ(told.stages.front(), "reading");
  EXPECT_EQ(told.stages.back(), "writing");
  EXPECT_EQ(told.percentages.front(), 0);
  EXPECT_GE(told.percentages.back(), 90);
  EXPECT_LE(told.percentages.back(), 100);
  EXPECT_TRUE(std::is_sorted(told.percentages.begin(), told.percentages.end())) << outcome.err;
}

TEST_F(ToolStreams, ProgressOfSeveralInputsIsOne)
{
  write("other.xyz", rows_);
  const tool::Outcome outcome = succeed({"sphere.xyz", "other.xyz", "--output-directory", "out", "--progress", "-q"});
  const Told told(outcome.err);
  EXPECT_TRUE(std::is_sorted(told.percentages.begin(), told.percentages.end())) << outcome.err;
  ASSERT_FALSE(told.stages.empty());
  EXPECT_EQ(told.stages.front(), "1 of 2, reading");
  EXPECT_EQ(told.stages.back(), "2 of 2, writing");
  const auto second = std::find(told.stages.begin(), told.stages.end(), "2 of 2, reading");
  ASSERT_NE(second, told.stages.end());
  EXPECT_EQ(told.percentages[second - told.stages.begin()], 50);
}

TEST_F(ToolStreams, ATerminalHasABarThatNeverFalls)
{
  ASSERT_TRUE(tool::hasProgram("script")) << "it runs a program in a terminal and is in the list of packages";
  const tool::Outcome outcome =
      shell("script -qec \"$TOOL sphere.xyz out.ply -q; $TOOL sphere.xyz out.ply > log\" typescript "
            "> /dev/null < /dev/null; cat typescript");
  std::vector<int> percentages;
  for (std::size_t at = outcome.out.find("] "); at != std::string::npos; at = outcome.out.find("] ", at + 1))
    percentages.push_back(std::atoi(outcome.out.c_str() + at + 2));
  EXPECT_GE(percentages.size(), 8u) << outcome.out;
  EXPECT_TRUE(std::is_sorted(percentages.begin(), percentages.end())) << outcome.out << "; -q has none";
  EXPECT_NE(outcome.out.find("\r\033[K"), std::string::npos);
}

/// Starts a long run and waits for its temporary file. (Shells make background programs ignore SIGINT and SIGQUIT; env
/// undoes it.)
const std::string untilThere =
    "env --default-signal=INT,QUIT $TOOL large.xyz out.ply -q & until ls -A | grep -q part; do "
    "sleep .01; kill -0 $! || exit 99; done; ";

TEST_F(ToolStreams, SignalsLeaveNothing)
{
  // Seconds of work, so that the signal comes in its middle.
  write("large.xyz", tool::sphereRows(60000));
  for (const int signal : {SIGHUP, SIGQUIT, SIGSEGV, SIGABRT, SIGUSR1, SIGXCPU}) {
    SCOPED_TRACE(signal);
    const tool::Outcome outcome =
        shell("ulimit -c 0; " + untilThere + "kill -" + std::to_string(signal) + " $!; wait $!");
    EXPECT_EQ(outcome.status, 128 + signal) << outcome.err;
    EXPECT_EQ(results(), std::vector<std::string>{});
  }
  // Users ask for these two: the first is answered by an orderly end, the second is not waited for.
  for (const int signal : {SIGINT, SIGTERM}) {
    SCOPED_TRACE(signal);
    const std::string kill = "kill -" + std::to_string(signal) + " $!; ";
    const tool::Outcome outcome = shell("" + untilThere + kill + kill + "wait $!");
    EXPECT_TRUE(outcome.status == 3 || outcome.status == 128 + signal) << outcome.status << outcome.err;
    EXPECT_EQ(results(), std::vector<std::string>{});
  }
}

TEST_F(ToolStreams, OneSignalEndsAToolThatWaitsForInput)
{
  const tool::Outcome outcome = shell(
      "mkfifo nobody.xyz; env --default-signal=INT timeout 20 $TOOL nobody.xyz out.ply -q & until ls -A | grep -q "
      "part; do sleep .01; kill -0 $! || exit 99; done; sleep .2; kill -INT $!; wait $!");
  EXPECT_EQ(outcome.status, 3) << outcome.err;
  EXPECT_NE(outcome.err.find("interrupted"), std::string::npos) << outcome.err;
  std::filesystem::remove(path("nobody.xyz"));
  EXPECT_EQ(results(), std::vector<std::string>{});
}

TEST_F(ToolStreams, AReaderThatGoesAwayIsNoError)
{
  const tool::Outcome outcome = shell("{ $TOOL sphere.xyz out.ply -v; echo $? > status; } | true");
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(tool::readText(path("status")), "0\n");
  EXPECT_EQ(results(), (std::vector<std::string>{"out.ply", "status"}));
}

TEST_F(ToolStreams, LinksAreFollowed)
{
  std::filesystem::create_directory(path("there"));
  std::filesystem::create_symlink("there/mesh.ply", path("second.ply"));
  std::filesystem::create_symlink("second.ply", path("first.ply"));
  expectFailure({"sphere.xyz", "first.ply"}, 1, "is not a regular file"); // which is not there yet
  write("there/mesh.ply", "");
  const tool::Outcome outcome = shell("$TOOL sphere.xyz first.ply -q");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_TRUE(std::filesystem::is_symlink(path("first.ply")));
  EXPECT_TRUE(std::filesystem::is_symlink(path("second.ply")));
  EXPECT_GT(tool::readText(path("there/mesh.ply")).size(), 1000u);
}

TEST_F(ToolStreams, AFileThatCannotGrowSaysWhy)
{
  // A limit of size stands for a full disk: the writing call fails alike, and says which of the two it was.
  for (const std::string name : {"out.ply", "out.obj", "out.stl", "out.vtk", "out.vtp", "out.glb", "out.dae"}) {
    SCOPED_TRACE(name);
    const tool::Outcome outcome = shell("ulimit -f 4; exec $TOOL sphere.xyz " + name + " -q");
    EXPECT_EQ(outcome.status, 1);
    EXPECT_EQ(outcome.err, "pcl_mrf_reconstruction: '" + name + "': could not be written: File too large\n");
    EXPECT_EQ(results(), std::vector<std::string>{});
  }
  const tool::Outcome field = shell("ulimit -f 80; exec $TOOL sphere.xyz out.ply --field field.vti -q");
  EXPECT_EQ(field.err, "pcl_mrf_reconstruction: 'field.vti': could not be written: File too large\n");
  EXPECT_EQ(results(), std::vector<std::string>{});
}

TEST_F(ToolStreams, FilesOfFloatsSayWhatSurveyCoordinatesAreRelativeTo)
{
  const Eigen::Vector3d center(431234.56, 4500123.78, 321.12);
  write("survey.xyz", tool::sphereRows(400, 2, center));
  for (const std::string name : {"out.stl", "out.glb"}) {
    const tool::Outcome outcome = succeed({"survey.xyz", name, "--report", "r.json", "-q"});
    EXPECT_NE(outcome.err.find("warning: '" + name + "' is written relative to (43123"), std::string::npos)
        << outcome.err;
    const nlohmann::json report = parsed("r.json");
    for (std::size_t axis = 0; axis < 3; ++axis)
      // In whole units, because the sphere is a few of them wide.
      EXPECT_NEAR(report.at("offset").at(axis), center[axis], 1.);
    EXPECT_EQ(report.at("warnings").size(), 1u);
  }
}

} // namespace
