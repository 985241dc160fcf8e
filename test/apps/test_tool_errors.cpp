// SPDX-License-Identifier: BSD-3-Clause
// Errors of the tool: one line on standard error, the right status, and no output.
#include "support/tool.h"

#include <sys/stat.h>
#include <unistd.h>

namespace {

using testing::TestWithParam;

class ToolErrors : public tool::Test {
protected:
  ToolErrors() { write("sphere.xyz", tool::sphereRows(400)); }
};

TEST_F(ToolErrors, MissingAndUnreadableInput)
{
  expectFailure({"nowhere.ply", "out.ply"}, 1, "'nowhere.ply': No such file or directory");
  std::filesystem::create_directory(path("folder.ply"));
  expectFailure({"folder.ply", "out.ply"}, 1, "'folder.ply': is a directory");
  chmod(path("sphere.xyz").c_str(), 0);
  if (geteuid() != 0)
    expectFailure({"sphere.xyz", "out.ply"}, 1, "Permission denied");
}

TEST_F(ToolErrors, BadFiles)
{
  write("empty.ply", "");
  expectFailure({"empty.ply", "out.ply"}, 1,
                "'empty.ply': is empty; write it anew, or leave it out if there are other inputs");
  write("nan.xyz", "nan nan nan\nnan nan nan\n");
  expectFailure({"nan.xyz", "out.ply"}, 1, "'nan.xyz'");
}

TEST_F(ToolErrors, ControlCharactersOfNamesAreEscaped)
{
  const std::string name = "a\nb\x1b[31m.xyz", escaped = "a\\nb\\x1b[31m.xyz";
  expectFailure({name, "out.ply"}, 1, "'" + escaped + "': No such file or directory");
  expectFailure({"sphere.xyz", "out.ply", "--work-directory", "sphere.xyz/a\nb"}, 1, "'sphere.xyz/a\\nb' cannot");
  expectFailure({"sphere.xyz", "no\n/out.ply"}, 1, "'no\\n/out.ply': cannot be written: there is no folder ");
  expectFailure({"a\nb.doc", "out.ply"}, 2, "INPUT 'a\\nb.doc' does not end in");
  write(name, tool::sphereRows(400) + "NA NA NA 0 0 1\n");
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{name, name + ".ply"}, {name, "--output-directory", "a\nfolder"}}) {
    const tool::Outcome outcome = succeed(arguments);
    EXPECT_EQ(outcome.out.find('\x1b'), std::string::npos) << outcome.out;
    EXPECT_EQ(outcome.err.find('\x1b'), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.out.find(escaped), std::string::npos) << outcome.out;
  }
}

TEST_F(ToolErrors, Usage)
{
  expectFailure({}, 2, "INPUT");
  expectFailure({"sphere.xyz"}, 2, "OUTPUT");
  expectFailure({"sphere.xyz", "", "--output-format", "ply"}, 2, "'' is not the name of a file");
  expectFailure({"sphere.xyz", "out.ply", "--nonsense"}, 2, "'--nonsense' is not an option");
  expectFailure({"sphere.xyz", "out.ply", "--nonsense", "3"}, 2, "'--nonsense' is not an option");
  for (const char* typed : {"-voxel-size", "-voxel-size=.1"})
    expectFailure({"sphere.xyz", "out.ply", typed, ".1"}, 2,
                  "'" + std::string(typed) + "' is not an option; did you mean --voxel-size?");
  expectFailure({"sphere.xyz", "out.ply", "-verbose", "--voxel-size", ".1"}, 2, "'-verbose' is not an option; did you");
  expectFailure({"sphere.xyz", "out.ply", "--beta"}, 2, "--beta needs a value");
  expectFailure({"sphere.xyz", "out.ply", "--beta", ".5", "--beta", ".6"}, 2, "--beta is given more than once");
  expectFailure({"sphere.xyz", "out.doc"}, 2, "does not end in ply, obj, stl, vtk, vtp, glb, dae or 3mf");
  expectFailure({"sphere.xyz", "out"}, 2, "does not end in");
  for (const std::string folder : {".", "./"})
    expectFailure({"sphere.xyz", folder}, 2,
                  "OUTPUT '" + folder + "' is a folder; name the mesh in it, or say --output-directory " + folder);
  expectFailure({"sphere.doc", "out.ply"}, 2,
                "does not end in pcd, ply, obj, off, xyz, txt, asc, csv, tsv, dat, pts, ptx or las, also with .gz");
  const std::vector<std::pair<std::string, std::string>> conversions = {
      {"LAZ", "laszip -i 'scan.LAZ' -o cloud.las, or pdal translate 'scan.LAZ' cloud.las, makes"},
      {"e57", "CloudCompare -SILENT -C_EXPORT_FMT PLY -O 'scan.e57' -SAVE_CLOUDS makes"},
      {"rcp", "Autodesk ReCap exports"},
      {"rcs", "Autodesk ReCap exports"},
      {"vtk", "pcl_vtk2ply 'scan.vtk' mesh.ply"},
      {"stl", "it holds a mesh, not points: pcl_mrf_scan 'scan.stl' cloud.ply samples points on it"},
      {"pwn", "call it xyz"},
      {"npts", "call it xyz"}};
  for (const auto& [type, words] : conversions)
    expectFailure({"scan." + type, "out.ply"}, 2, "csv, tsv, dat, pts, ptx or las, also with .gz; " + words);
  expectFailure({"sphere.xyz", "out.ply", "--report", "r.txt"}, 2, ".json");
  expectFailure({"sphere.xyz", "out.ply", "--field", "f.vtk"}, 2, ".vti");
  expectFailure({"sphere.xyz", "out.ply", "--picture", "p.jpg"}, 2, ".png");
}

TEST_F(ToolErrors, BadValues)
{
  // Ranges and words are those of the table of options.
  for (const char* value : {"1", "nan", "much", "0.5x", "", "-9e999", "9e999"})
    expectFailure({"sphere.xyz", "out.ply", "--beta", value}, 2, "--beta");
  for (const char* value : {"1,2", "1,2,three", "1,2,nan"})
    expectFailure({"sphere.xyz", "out.ply", "--sensor", value}, 2, "--sensor");
  for (const char* value : {"above", "", "0,0,0", "1,2", "1,2,nan"})
    expectFailure({"sphere.xyz", "out.ply", "--picture", "p.png", "--camera", value}, 2,
                  "--camera: '" + std::string(value) + "' is none of front, back, left, right, top, bottom");
  expectFailure({"sphere.xyz", "out.ply", "--camera", "top"}, 2, "--camera: 'top' has no picture to be for; say --pic");
  for (const char* option : {"--preset", "--remesh", "--threads", "--trim", "--alone-filter", "--neighbors"})
    expectFailure({"sphere.xyz", "out.ply", option, "-2"}, 2, option);
  // The message says what would be right.
  expectFailure({"sphere.xyz", "out.ply", "--beta", "3"}, 2, "--beta: '3' is outside its range [0, 1)");
  expectFailure({"sphere.xyz", "out.ply", "--beta", "much"}, 2, "'much' is not a number; its range is [0, 1)");
  expectFailure({"sphere.xyz", "out.ply", "--neighbors", "5.5"}, 2, "'5.5' is not a whole number");
  expectFailure({"sphere.xyz", "out.ply", "--padding", "1"}, 2, "'1' is outside its range [2, 100] voxels (0 = ");
  expectFailure({"sphere.xyz", "out.ply", "--color", "gr\ney"}, 2, "'gr\\ney' is none of");
  // Single precision has no such numbers: they are infinite, 1, and 0.
  for (const auto& [option, value] : {std::pair<const char*, const char*>{"--max-distance", "1e39"},
                                      {"--beta", ".999999999"},
                                      {"--orientation-angle", "1e-50"},
                                      {"--smoothing", "1e39"},
                                      {"--max-memory", "8X"},
                                      {"--max-memory", "G"},
                                      {"--max-memory", "1e30"}})
    expectFailure({"sphere.xyz", "out.ply", option, value}, 2, std::string(option) + ": '" + value + "'");
  expectFailure({"sphere.xyz", "out.ply", "--prior", "flat"}, 2, "membrane, thin-plate, triharmonic");
  // What the library refuses is called as on the command line.
  for (const std::string option : {"--voxel-size", "--smoothing"})
    expectFailure({"sphere.xyz", "out.ply", option, "100"}, 2, option + " 100 is larger than the cloud");
}

TEST_F(ToolErrors, ConflictingOptions)
{
  write("sensors.txt", "0 0 3\n");
  write("views.txt", "0\n0\n");
  const std::vector<std::vector<std::string>> conflicts = {{"--remesh", "3", "--no-remesh"},
                                                           {"--sensor", "0,0,3", "--sensors", "sensors.txt"},
                                                           {"--views", "views.txt"},
                                                           {"-v", "-q"},
                                                           {"--noise", "1", "--noise-field", "column6"},
                                                           {"--noise", "1", "--noise-model", "kinect"},
                                                           {"--noise-model", "none", "--noise-field", "column6"},
                                                           {"--smoothing", "1", "--noise-model", "constant:1"},
                                                           {"--noise-model", "tof:1,1"},
                                                           {"--observation", "mean", "--noise-model", "none"},
                                                           {"--observation", "mean", "--noise-field", "column6"},
                                                           {"--trim", "none", "--max-hole", "1"}};
  for (const std::vector<std::string>& options : conflicts)
    expectFailure(tool::with({"sphere.xyz", "out.ply"}, options), 2, "--");
  expectFailure({"sphere.xyz", "out.ply", "--noise-model", "quadratic:1"}, 2,
                "--noise-model quadratic:1 has 1 numbers where quadratic takes 2");
}

TEST_F(ToolErrors, SensorFiles)
{
  const std::vector<std::string> base = {"sphere.xyz", "out.ply", "--sensors", "sensors.txt"};
  const std::vector<std::string> withViews = tool::with(base, {"--views", "views.txt"});
  expectFailure(base, 1, "'sensors.txt': No such file");
  write("sensors.txt", "0 0 3\n0 0\n");
  expectFailure(base, 1, "'sensors.txt': line 2");
  write("sensors.txt", "# none\n");
  expectFailure(base, 1, "holds no sensor positions");
  write("sensors.txt", "0 0 3\n");
  write("views.txt", "0\n0\n");
  expectFailure(withViews, 1, "2 views for 400 points");
  std::string views;
  for (int i = 0; i < 400; ++i)
    views += "1\n";
  write("views.txt", views);
  expectFailure(withViews, 1, "names sensor 1");
  write("views.txt", "0.5\n");
  expectFailure(withViews, 1, "'views.txt': line 1");
}

TEST_F(ToolErrors, OutputsAreCheckedBeforeTheWork)
{
  std::filesystem::create_directory(path("folder.ply"));
  expectFailure({"sphere.xyz", "nowhere/out.ply"}, 1, path("nowhere").string());
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
  write("two.xyz", "0 0 0\n1 0 0\n"); // too few, which is seen later
  expectFailure({"two.xyz", "sphere.ply"}, 1, "two.xyz");
  EXPECT_EQ(tool::readText(path("sphere.ply")), "kept");
  if (geteuid() != 0) {
    std::filesystem::create_directory(path("closed"));
    chmod(path("closed").c_str(), 0500);
    expectFailure({"sphere.xyz", "closed/out.ply"}, 1, "Permission denied");
  }
}

TEST_F(ToolErrors, PointsCountAsMemory)
{
  expectFailure({"sphere.xyz", "out.ply", "--max-memory", "0.001"}, 3, "MiB is too little for 400 points");
}

TEST_F(ToolErrors, WorkDirectories)
{
  expectFailure({"sphere.xyz", "out.ply", "--resume"}, 2, "--work-directory");
  write("file", "");
  expectFailure({"sphere.xyz", "out.ply", "--work-directory", "file"}, 1,
                "the work directory 'file' cannot be written to");
  const std::string error = run({"sphere.xyz", "out.ply", "--work-directory", "/sys/work"}).err;
  EXPECT_EQ(error.find("No such file"), std::string::npos) << "not why the folder cannot be made: " << error;
  succeed({"sphere.xyz", "out.ply", "--work-directory", "work"});
  EXPECT_FALSE(std::filesystem::exists(path("work"))) << "left behind";
  std::filesystem::create_directory(path("work"));
  write("work/pcl_mrf_journal.txt", "a result of a run that was ended\n");
  expectFailure({"sphere.xyz", "other.ply", "--work-directory", "work"}, 1, "go on with it (--resume)");
  EXPECT_FALSE(std::filesystem::exists(path("other.ply")));
  const std::string log = succeed({"sphere.xyz", "other.ply", "--work-directory", "work", "--resume"}).out;
  EXPECT_NE(log.find("nothing to resume: no part of this run was there"), std::string::npos) << log;
}

// scans/*.ply without an OUTPUT: the last scan is not overwritten, whether there are two or many.
TEST_F(ToolErrors, ScansAreNotReplaced)
{
  const std::string vertices = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n",
                    rows = "0 0 0\n1 0 0\n0 1 0\n", bareRows = "v 0 0 0\nv 1 0 0\nv 0 1 0\n",
                    list = "property list uchar int vertex_indices\n";
  write("other.xyz", rows);
  const std::vector<std::pair<std::string, std::string>> scans = {
      {"bare.ply", "ply\nformat ascii 1.0\n" + vertices + "end_header\n" + rows},
      {"meshlab.ply", "ply\nformat ascii 1.0\n" + vertices + "element face 0\n" + list + "end_header\n" + rows},
      {"scan.obj", bareRows},
      {"scan.off", "OFF # of no faces\n3 0 0\n" + rows},
      {"scan.xyz", rows},
      {"scan.pcd", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 3\nDATA ascii\n" + rows}};
  for (const auto& [name, text] : scans) {
    write(name, text);
    expectFailure(
        {"sphere.xyz", name, "--output-format", "ply"}, 2,
        "OUTPUT '" + name +
            "' is there and holds points without faces: if it is an INPUT, name OUTPUT behind it, else delete");
    expectFailure({"sphere.xyz", "other.xyz", name, "--output-format", "ply"}, 2, "OUTPUT '" + name + "' is there");
    EXPECT_EQ(tool::readText(path(name)), text);
  }
  // A mesh is, and what is empty.
  write("mesh.obj", bareRows + "f 1 2 3\n");
  write("empty.ply", "");
  for (const char* name : {"mesh.obj", "mesh.obj", "empty.ply", "empty.ply"})
    succeed({"sphere.xyz", name});
}

TEST_F(ToolErrors, SeveralInputs)
{
  write("other.xyz", tool::sphereRows(400, 2, {3, 0, 0}));
  std::filesystem::create_symlink("other.xyz", path("link.xyz"));
  expectFailure({"sphere.xyz", "other.xyz", "./sphere.xyz", "out.ply"}, 2, "INPUT './sphere.xyz' is given twice");
  expectFailure({"other.xyz", "link.xyz", "out.ply"}, 2, "INPUT 'link.xyz' is given twice");
  expectFailure({"-", "-", "out.ply"}, 2, "INPUT '-' is given twice");
  expectFailure({"sphere.xyz", "absent.xyz", "out.ply"}, 1, "'absent.xyz': No such file or directory");
  expectFailure({"sphere.xyz", "other.doc", "out.ply"}, 2, "INPUT 'other.doc' does not end in pcd");
  expectFailure({"sphere.xyz", "link.xyz", "other.xyz", "--output-format", "ply"}, 2, "would be overwritten");
  write("bare.xyz", "0 0 0\n1 0 0\n0 1 0\n");
  for (const char* source : {"use", "reference"})
    expectFailure({"sphere.xyz", "bare.xyz", "out.ply", "--normals", source}, 2, "'bare.xyz' has no normals");
  write("trust.xyz", "0 0 0 .5\n1 0 0 .5\n0 1 0 .5\n");
  for (const std::string option : {"--confidence-field", "--noise-field"})
    expectFailure({"trust.xyz", "sphere.xyz", "out.ply", option, "intensity"}, 2,
                  option + ": 'sphere.xyz' has no field 'intensity'");
  // What was said of the files when they were joined may be why.
  const tool::Outcome outcome = run({"bare.xyz", "trust.xyz", "out.ply", "--report", "r.json"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.err.rfind("warning: 'bare.xyz' has no intensities: those of the other files are left out\n"
                              "pcl_mrf_reconstruction: 'bare.xyz and 1 other file': ",
                              0),
            0u)
      << outcome.err;
  EXPECT_EQ(parsed("r.json")["warnings"].size(), 1u);
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

} // namespace
