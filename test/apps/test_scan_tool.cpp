// SPDX-License-Identifier: BSD-3-Clause
// pcl_mrf_scan as users run it: its files and its errors.
#include "support/point_table.h"
#include "support/sensors.h"
#include "support/tool.h"

#include <shapes/signed_distance.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace {

using Eigen::Vector3d;

class ScanTool : public tool::Test {
protected:
  ScanTool() : Test(MRF_SCAN_TOOL)
  {
    // A box without a lid, seen from above: its faces point inwards and up.
    write("bowl.off", "OFF\n8 5 0\n0 0 0\n3 0 0\n3 4 0\n0 4 0\n0 0 2\n3 0 2\n3 4 2\n0 4 2\n"
                      "4 0 1 2 3\n4 0 4 5 1\n4 1 5 6 2\n4 2 6 7 3\n4 3 7 4 0\n");
  }

  void expectSuccess(const std::vector<std::string>& arguments) const
  {
    EXPECT_EQ(succeed(arguments).err, "") << "progress is for terminals";
  }

  mrf_apps::PointTable points(const std::string& name) const { return mrf_apps::readPoints(path(name).string()); }
};

/// A bound of the length of an error of half a unit in the last place of the largest coordinate along each axis.
double floatError(double largest)
{
  return 2 * largest * 0x1p-24;
}

TEST_F(ScanTool, AllFilesBelongTogether)
{
  expectSuccess({"torus",           "scan.ply", "--points",         "3000",     "--views",       "5",
                 "--holes",         "2",        "--hole-radius",    "6%:9%",    "--hole",        "-1.4,0,0",
                 "--outliers",      "2",        "--noise",          "0.5s",     "--write-views", "v.txt",
                 "--write-sensors", "s.txt",    "--write-held-out", "held.pcd", "--write-clean", "clean.ply",
                 "--report",        "r.json"});
  const auto cloud = points("scan.ply"), clean = points("clean.ply"), held = points("held.pcd");
  const auto sensors = mrf_apps::parseSensors("s.txt", tool::readText(path("s.txt")));
  const auto views = mrf_apps::parseViews("v.txt", tool::readText(path("v.txt")));
  const nlohmann::json report = parsed("r.json");
  ASSERT_EQ(sensors.size(), 5u);
  ASSERT_EQ(views.size(), cloud.size());
  ASSERT_EQ(cloud.normals.size(), cloud.size());
  EXPECT_EQ(clean.size() + held.size(), 3000u);
  EXPECT_EQ(report["inliers"], clean.size());
  EXPECT_EQ(report["heldOut"], held.size());
  EXPECT_EQ(report["points"], cloud.size());
  EXPECT_EQ(report["outliers"], cloud.size() - clean.size());
  EXPECT_EQ(report["outliers"], std::llround(static_cast<double>(clean.size()) * .02 / .98));
  EXPECT_EQ(report["holes"].size(), 3u);

  const auto torus = shapes::torus(1, .4);
  for (const auto* table : {&clean, &held})
    for (const Vector3d& x : table->positions)
      ASSERT_LT(std::abs(torus(x)), floatError(1.4));
}

TEST_F(ScanTool, ScannerAmidAStreet)
{
  expectSuccess({"street", "o.ply", "--sampling", "scanner", "--points", "2000", "--axis", "0,0,1", "--sensor",
                 "0,0,1.8", "--aspect", "8", "--elevations", "-30:10", "--write-sensors", "s.txt"});
  ASSERT_EQ(mrf_apps::parseSensors("s.txt", tool::readText(path("s.txt"))).size(), 1u);
  double highest = 0, behind = 0;
  std::set<long> rings;
  const auto cloud = points("o.ply");
  for (const Vector3d& x : cloud.positions) {
    const double distance = std::hypot(x.x(), x.y()), elevation = std::atan2(x.z() - 1.8, distance) * 180 / M_PI;
    ASSERT_GE(elevation, -30.001);
    ASSERT_LE(elevation, 10.001);
    highest = std::max(highest, x.z());
    behind += x.x() < 0 ? 1. / static_cast<double>(cloud.size()) : 0;
    rings.insert(std::lround(100 * elevation));
  }
  EXPECT_GT(highest, 1.8);
  EXPECT_NEAR(behind, .5, .15) << "it turns around";
  EXPECT_LT(rings.size(), 20u) << "few elevations, many points at each";
  expectSuccess(
      {"torus", "o.ply", "--sensor", "0,0,9", "--sensor", "0,9,0", "--points", "500", "--write-sensors", "s.txt"});
  EXPECT_EQ(mrf_apps::parseSensors("s.txt", tool::readText(path("s.txt"))).size(), 2u);
}

TEST_F(ScanTool, DevicesAndTheirTruth)
{
  for (const std::string device : {"depth-camera", "lidar", "structured-light", "photogrammetry"}) {
    expectSuccess({"person", "o.ply", "--device", device, "--points", "2000", "--write-clean", "clean.ply",
                   "--write-truth", "truth.ply", "--normals", "estimated", "--report", "r.json"});
    const auto cloud = points("o.ply"), clean = points("clean.ply"), truth = points("truth.ply");
    EXPECT_EQ(cloud.normals.size(), cloud.size());
    EXPECT_GT(truth.size(), 1000u);
    EXPECT_EQ(parsed("r.json")["outliers"], cloud.size() - clean.size());
  }
  const auto bytes = [&](const std::vector<std::string>& more) {
    expectSuccess(tool::with({"person", "o.ply", "--points", "1000", "--device", "depth-camera"}, more));
    return tool::readText(path("o.ply"));
  };
  // Wherever it stands, a device leaves what is asked for as well.
  EXPECT_NE(bytes({}), bytes({"--noise", "1%"}));
  EXPECT_NE(bytes({}), bytes({"--baseline", "0.15"}));
  EXPECT_NE(bytes({}), bytes({"--focal-length", "300"}));
}

TEST_F(ScanTool, OptionsReachTheScan)
{
  expectSuccess({"bowl.off", "o.pcd", "--normals", "none", "--views", "0", "--points", "500", "-q"});
  EXPECT_TRUE(points("o.pcd").normals.empty());
  EXPECT_EQ(points("o.pcd").size(), 500u);

  // From straight above, and only the bottom is within ten degrees.
  write("above.txt", "1.5 2 100\n");
  expectSuccess({"bowl.off", "o.ply", "--sensors", "above.txt", "--points", "500", "--grazing", "10"});
  for (const Vector3d& x : points("o.ply").positions)
    ASSERT_EQ(x.z(), 0);
  // From the side, the wall is in the way of the bottom.
  write("side.txt", "-50 2 5\n");
  expectSuccess({"bowl.off", "o.ply", "--sensors", "side.txt", "--points", "500", "--grazing", "90"});
  for (const Vector3d& x : points("o.ply").positions)
    ASSERT_GT(x.z(), 0) << "the bottom is hidden";

  expectSuccess({"cut-sphere:radius=40,angle=37", "o.ply", "--rotate", "0,90,0", "--views", "0", "--points", "500"});
  for (const Vector3d& x : points("o.ply").positions) {
    ASSERT_NEAR(x.norm(), 40, floatError(40) * std::sqrt(3));
    ASSERT_GT(x.x(), 40 * std::cos(37 * M_PI / 180) - floatError(40));
  }
}

/// Options that are refused in a scan of a torus into o.ply, and words of the message.
struct Refusal {
  std::vector<std::string> options;
  const char* words;
};

const std::vector<Refusal> refusals = {
    {{"--outliers", "60", "--clusters", "60"}, "utliers"},
    {{"--misalign-angle", "-1"}, "misalignment"},
    {{"--hole-radius", "2:7%"}, "in one unit"},
    {{"--hole-radius", "2:1"}, "the smaller one first"},
    {{"--rotate", "nan,0,0"}, "--rotate"},
    {{"--grazing", "0"}, "grazing"},
    {{"--grazing", "91"}, "grazing"},
    {{"--views", "-1"}, "--views"},
    {{"--distance", "0"}, "distance"},
    {{"--axis", "0,0,0"}, "axis"},
    {{"--front", "0,1,0"}, "parallel to the axis"},
    {{"--hole", "1,2"}, "--hole"},
    {{"--holes", "500"}, "holes find room"},
    {{"--write-held-out", "h.ply"}, "--holes"},
    {{"--views", "0", "--write-views", "v.txt"}, "--views is 0"},
    {{"--views", "0", "--misalign-angle", "1"}, "--views is 0"},
    {{"--views", "0", "--sampling", "scanner"}, "--views is 0"},
    {{"--sampling", "scanner", "--aspect", "0"}, "aspect"},
    {{"--sampling", "scanner", "--aspect", "nan"}, "--aspect"},
    {{"--sampling", "scanner", "--elevations", "3"}, "--elevations"},
    {{"--sampling", "scanner", "--elevations", "3:-3"}, "elevations"},
    {{"--sampling", "scanner", "--elevations", "-91:0"}, "elevations"},
    {{"--device", "lidra"}, "lidar"},
    {{"--device", "lidar", "--views", "0"}, "--views is 0"},
    {{"--device", "photogrammetry", "--views", "0"}, "need sensors"},
    {{"--device", "lidar", "--baseline", "0.1"}, "depth-camera"},
    {{"--device", "depth-camera", "--baseline", "0"}, "--baseline"},
    {{"--device", "lidar", "--focal-length", "500"}, "--sampling camera"},
    {{"--device", "depth-camera", "--focal-length", "-1"}, "--focal-length"},
    {{"--device", "depth-camera", "--sampling", "even"}, "pixels of its image"},
    {{"--device", "depth-camera", "--sensor", "0,0,9", "--front", "0,0,0"}, "front direction"},
    {{"--write-truth", "t.xyz"}, "--write-truth"},
    {{"--sensor", "0,0,9", "--sensors", "s.txt"}, "exclude"},
    {{"--write-clean", "o.ply"}, "twice"}};

TEST_F(ScanTool, WrongUsage)
{
  expectFailure({}, 2, "INPUT");
  expectFailure({"torus"}, 2, "OUTPUT");
  expectFailure({"tours", "o.ply"}, 2, "no shape");
  expectFailure({"torus:mayor=2", "o.ply"}, 2, "unknown parameter 'mayor', it has major, minor");
  expectFailure({"torus:minor=0", "o.ply"}, 2, "minor");
  expectFailure({"bowl.xyz", "o.ply"}, 2, "does not end in");
  expectFailure({"torus", "o.xyz"}, 2, "'o.xyz' does not end in ply or pcd");
  for (const char* value : {"0", "-5", "2.5", "x", "1e12", ""})
    expectFailure({"torus", "o.ply", "--points", value}, 2, "--points");
  for (const char* option : {"--noise", "--misalign-shift", "--hole-radius"})
    for (const char* value : {"-1", "1m", "nan", "x", "1:"})
      expectFailure({"torus", "o.ply", option, value}, 2, option);
  for (const char* value : {"100", "-1", "nan"})
    expectFailure({"torus", "o.ply", "--outliers", value}, 2, "utliers");
  for (const auto& [options, words] : refusals)
    expectFailure(tool::with({"torus", "o.ply"}, options), 2, words);
  write("bowl.ply", "");
  expectFailure({"bowl.ply", "bowl.ply"}, 2, "would be overwritten");
}

TEST_F(ScanTool, WrongInput)
{
  // meshes/*.ply without an OUTPUT: the second mesh is not overwritten, a cloud is.
  write("mesh.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  expectFailure({"bowl.off", "mesh.ply"}, 2, "OUTPUT 'mesh.ply' is there and holds a mesh: if it is an INPUT");
  for (int run = 0; run < 2; ++run)
    expectSuccess({"bowl.off", "again.ply", "--points", "100", "--quiet"});
  expectFailure({"nowhere.off", "o.ply"}, 1, "'nowhere.off': No such file or directory");
  expectFailure({"bowl.off", "nowhere/o.ply"}, 1, "nowhere/o.ply");
  expectFailure({"bowl.off", "o.ply", "--sensors", "nowhere.txt"}, 1, "nowhere.txt");
  write("line.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n");
  write("nan.off", "OFF\n3 1 0\n0 0 nan\n1 0 0\n1 1 0\n3 0 1 2\n");
  write("index.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1 7\n");
  for (const char* name : {"line.off", "nan.off", "index.off"})
    expectFailure({name, "o.ply", "--report", "r.json"}, 1, name);
  write("inside.txt", "1 0 0\n");
  expectFailure({"torus", "o.ply", "--sensors", "inside.txt"}, 1, "is seen");
  expectFailure({"sphere", "o.ply", "--sampling", "scanner", "--sensor", "0,0,0"}, 1, "is seen");
  expectFailure({"street", "o.ply", "--sampling", "scanner", "--sensor", "0,0,1.8", "--axis", "0,0,1", "--front",
                 "1,0,0", "--elevations", "85:90"},
                1, "next to no ray"); // there is nothing above a street
  expectFailure({"torus", "o.ply", "--hole", "0,0,0", "--hole-radius", "9"}, 1, "leave no points");
}

} // namespace
