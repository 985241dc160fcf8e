// SPDX-License-Identifier: BSD-3-Clause
// What the tool leaves behind: whole files, or none, whatever ends it.
#include "support/tool.h"

#include <algorithm>
#include <csignal>

namespace {

class ToolOutputs : public tool::Test {
protected:
  ToolOutputs() { write("sphere.xyz", tool::sphereRows(400)); }

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
};

/// Starts a long run and waits for its temporary file. (The shell has programs in the background ignore SIGINT and
/// SIGQUIT, which env undoes.)
const std::string untilThere =
    "env --default-signal=INT,QUIT $TOOL large.xyz out.ply -q & until ls -A | grep -q part; do "
    "sleep .01; kill -0 $! || exit 99; done; ";

TEST_F(ToolOutputs, SignalsLeaveNothing)
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

TEST_F(ToolOutputs, AReaderThatGoesAwayIsNoError)
{
  const tool::Outcome outcome = shell("{ $TOOL sphere.xyz out.ply -v; echo $? > status; } | true");
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(tool::readText(path("status")), "0\n");
  EXPECT_EQ(results(), (std::vector<std::string>{"out.ply", "status"}));
}

TEST_F(ToolOutputs, LinksAreFollowed)
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

TEST_F(ToolOutputs, AFileThatCannotGrowSaysWhy)
{
  // A limit of size stands for a full disk: the writing call fails alike, and says which of the two it was.
  for (const std::string name : {"out.ply", "out.obj", "out.stl", "out.vtk", "out.vtp"}) {
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

TEST_F(ToolOutputs, StlOfSurveyCoordinatesSaysWhatItIsRelativeTo)
{
  std::string rows;
  const Eigen::Vector3d center(431234.56, 4500123.78, 321.12);
  for (const Eigen::Vector3d& p : tool::spherePoints(400)) {
    const Eigen::Vector3d q = p + center;
    for (const double value : {q.x(), q.y(), q.z()})
      rows += std::to_string(value) + " ";
    rows += "\n";
  }
  write("survey.xyz", rows);
  const tool::Outcome outcome = run({"survey.xyz", "out.stl", "--report", "r.json", "-q"});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_NE(outcome.err.find("warning: 'out.stl' is written relative to (43123"), std::string::npos) << outcome.err;
  const nlohmann::json report = nlohmann::json::parse(tool::readText(path("r.json")));
  for (std::size_t axis = 0; axis < 3; ++axis)
    // In whole units, because the sphere is a few of them wide.
    EXPECT_NEAR(report.at("offset").at(axis), center[axis], 1.);
  EXPECT_EQ(report.at("warnings").size(), 1u);
}

} // namespace
