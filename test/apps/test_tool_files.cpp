// SPDX-License-Identifier: BSD-3-Clause
// Every input and output format, in files that other programs write and read.
#include "support/clouds.h"
#include "support/conversion.h"
#include "support/tool.h"

#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>
#include <pcl/surface/mrf/option_table.h>
#include <pcl/surface/mrf_reconstruction.h>

#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkOBJReader.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataReader.h>
#include <vtkSmartPointer.h>
#include <vtkSTLReader.h>
#include <vtkXMLImageDataReader.h>
#include <vtkXMLPolyDataReader.h>

#include <assimp/Importer.hpp>
#include <assimp/scene.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <sstream>

namespace {

using nlohmann::json;

constexpr int pointCount = 500;

template <typename Reader, typename Data = vtkPolyData>
vtkSmartPointer<Data> outputOf(const std::string& path)
{
  auto reader = vtkSmartPointer<Reader>::New();
  reader->SetFileName(path.c_str());
  reader->Update();
  return reader->GetOutput();
}

class ToolFiles : public tool::Test {
protected:
  /// The points as a cloud with normals and colors, whose red grows with z.
  static pcl::PointCloud<pcl::PointXYZRGBNormal> coloredSphere(double offset = 0)
  {
    pcl::PointCloud<pcl::PointXYZRGBNormal> cloud;
    for (const Eigen::Vector3d& p : tool::spherePoints(pointCount)) {
      pcl::PointXYZRGBNormal point;
      point.getVector3fMap() = (p.array() + offset).matrix().cast<float>();
      point.getNormalVector3fMap() = p.cast<float>();
      point.r = static_cast<std::uint8_t>(std::lround(127 * (p.z() + 1)));
      point.g = 50;
      point.b = 200;
      cloud.push_back(point);
    }
    return cloud;
  }

  /// Writes points as PCD. \param viewpoint where their sensor was; empty: nobody knows
  void writePcd(const std::string& name, const std::vector<Eigen::Vector3d>& points,
                const std::string& viewpoint = {}) const
  {
    std::ostringstream text;
    text.precision(17);
    text << "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\n";
    if (!viewpoint.empty())
      text << "VIEWPOINT " << viewpoint << " 1 0 0 0\n";
    text << "POINTS " << points.size() << "\nDATA ascii\n";
    for (const Eigen::Vector3d& point : points)
      text << point.transpose() << '\n';
    write(name, text.str());
  }

  /// Points of the unit sphere between two heights, about a center.
  static std::vector<Eigen::Vector3d> zone(int count, double from, double to, const Eigen::Vector3d& center)
  {
    std::vector<Eigen::Vector3d> points;
    for (const Eigen::Vector3d& p : tool::spherePoints(count))
      if (p.z() > from && p.z() <= to)
        points.emplace_back(p + center);
    return points;
  }

  pcl::PolygonMesh plyOf(const std::string& name) const
  {
    pcl::PolygonMesh mesh;
    EXPECT_EQ(pcl::io::loadPLYFile(path(name).string(), mesh), 0) << name;
    return mesh;
  }

  template <typename Point>
  static pcl::PointCloud<Point> verticesOf(const pcl::PolygonMesh& mesh)
  {
    pcl::PointCloud<Point> vertices;
    pcl::fromPCLPointCloud2(mesh.cloud, vertices);
    return vertices;
  }

  vtkSmartPointer<vtkImageData> readField(const std::string& name) const
  {
    return outputOf<vtkXMLImageDataReader, vtkImageData>(path(name));
  }
};

TEST_F(ToolFiles, PcdTellsWhereItsSensorWas)
{
  // A cap in coordinates that float does not hold, seen from its outer or its inner side.
  const auto volume = [&](const std::string& height, const std::vector<std::string>& options = {}) {
    writePcd("cap.pcd", zone(1000, .3, 1, {0, 4.5e6, 0}), "0 4500000 " + height);
    const tool::Outcome outcome = succeed(tool::with({"cap.pcd", "out.ply", "--report", "report.json"}, options));
    const json report = parsed("report.json");
    EXPECT_EQ(report["vote"], options.empty() || options[0] == "--sensor" ? "sensor" : "outward");
    EXPECT_EQ(report["sensorOriginUsed"], options.empty());
    EXPECT_EQ(outcome.out.find("the file's own viewpoint") != std::string::npos, options.empty());
    return report["mesh"]["volume"].get<double>();
  };
  EXPECT_LT(volume("9") * volume(".4"), 0) << "seen from outside and from inside";
  EXPECT_GT(volume("9") * volume(".4", {"--sensor", "0,4500000,9"}), 0) << "a given one wins";
  volume("9", {"--sensor-origin", "off"});
}

TEST_F(ToolFiles, AScanInSeveralFilesIsThatScan)
{
  // A sphere from within, in coordinates that float does not hold, and of which a part alone would have another offset.
  const auto pcd = [&](const std::string& name, double from, double to) {
    writePcd(name + ".pcd", zone(pointCount, from, to, {1234567, 7654321, 99}), "1234567 7654321 99");
    const std::string text = tool::readText(path(name + ".pcd"));
    write(name + ".xyz", text.substr(text.find("ascii") + 6));
  };
  pcd("whole", -2, .9);
  pcd("lower", -2, -.3);
  pcd("middle", -.3, .3);
  pcd("upper", .3, .9);
  reportOf({"whole.pcd", "whole.ply"});
  const json report = reportOf({"upper.pcd", "lower.pcd", "middle.pcd", "joined.ply"});
  EXPECT_EQ(report.at("input"), json({"upper.pcd", "lower.pcd", "middle.pcd"}));
  EXPECT_EQ(report.at("vote"), "sensor");
  EXPECT_EQ(tool::readText(path("joined.ply")), tool::readText(path("whole.ply")));
  reportOf({"whole.xyz", "whole.ply"});
  const json mixed = reportOf({"upper.xyz", "lower.pcd", "middle.xyz", "joined.ply", "--sensor-origin", "off"});
  EXPECT_EQ(mixed.at("vote"), "outward");
  EXPECT_EQ(tool::readText(path("joined.ply")), tool::readText(path("whole.ply"))) << "an earlier mesh is replaced";
}

TEST_F(ToolFiles, EachFileHasItsOwnSensor)
{
  // Caps side by side. The sensor of the second one is nearer to the first as well, and below it.
  writePcd("first.pcd", zone(1000, .3, 1, {0, 0, 0}), "0 0 30");
  writePcd("second.pcd", zone(1000, .3, 1, {4, 0, 0}), "3 0 -4");
  const auto upwardShare = [&](double x) { // of the normals of a cap
    int upward = 0, all = 0;
    for (const pcl::PointNormal& vertex : verticesOf<pcl::PointNormal>(plyOf("out.ply")))
      if (std::abs(vertex.x - x) < 1.5 && ++all > 0)
        upward += vertex.normal_z > 0;
    return upward / (all + 1e-9);
  };
  const tool::Outcome outcome = succeed({"first.pcd", "second.pcd", "out.ply"});
  EXPECT_NE(outcome.out.find("first.pcd and 1 other file: "), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("2 sensors, one known for each point"), std::string::npos) << outcome.out;
  EXPECT_GT(upwardShare(0), .95);
  EXPECT_LT(upwardShare(4), .05);

  writePcd("third.pcd", zone(1000, .3, 1, {8, 0, 0}));
  const tool::Outcome partly = succeed({"first.pcd", "third.pcd", "out.ply", "--report", "report.json"});
  const std::string warning = "'third.pcd' has no sensor position: those of the other files are left out; name all by "
                              "--sensors and --views";
  EXPECT_NE(partly.err.find("warning: " + warning), std::string::npos) << partly.err;
  EXPECT_EQ(parsed("report.json").at("/warnings/0"_json_pointer), warning);
  EXPECT_EQ(parsed("report.json").at("vote"), "outward");
  const tool::Outcome given = run({"first.pcd", "third.pcd", "out.ply", "--sensor", "4,0,30"});
  EXPECT_EQ(given.err, "") << "what the file says is not asked for";
}

TEST_F(ToolFiles, WhatPclWrites)
{
  const auto cloud = coloredSphere();
  pcl::PCDWriter pcd;
  ASSERT_EQ(pcd.writeASCII(path("ascii.pcd").string(), cloud), 0);
  ASSERT_EQ(pcd.writeBinary(path("binary.PCD").string(), cloud), 0);
  ASSERT_EQ(pcd.writeBinaryCompressed(path("compressed.pcd").string(), cloud), 0);
  pcl::PLYWriter ply;
  ASSERT_EQ(ply.write(path("binary.ply").string(), cloud, true), 0);
  ASSERT_EQ(ply.write(path("ascii.ply").string(), cloud, false), 0);
  for (const char* name : {"ascii.pcd", "binary.PCD", "compressed.pcd", "binary.ply", "ascii.ply"}) {
    SCOPED_TRACE(name);
    const json report = reportOf({name, "out.ply"});
    EXPECT_EQ(report.at("/points/used"_json_pointer), pointCount);
    EXPECT_EQ(report.at("/normalsEstimated"_json_pointer), false);
    EXPECT_EQ(report.at("/mesh/eulerCharacteristic"_json_pointer), 2);
    // Edges of .3 take about 5 % off the volume of the unit sphere.
    EXPECT_NEAR(report.at("/mesh/volume"_json_pointer), 4.0, .25);
  }
}

TEST_F(ToolFiles, EveryMeshFormatHoldsTheSameMesh)
{
  pcl::io::savePCDFileBinary(path("in.pcd").string(), coloredSphere());
  const json report = reportOf({"in.pcd", "out.ply"});
  const vtkIdType vertices = report.at("/mesh/vertices"_json_pointer),
                  triangles = report.at("/mesh/triangles"_json_pointer);
  for (const char* name : {"out.obj", "out.STL", "out.vtk", "out.vtp"})
    succeed({"in.pcd", name, "-q"});

  const pcl::PolygonMesh ply = plyOf("out.ply");
  const auto cloud = verticesOf<pcl::PointXYZRGBNormal>(ply);
  EXPECT_EQ(static_cast<vtkIdType>(cloud.size()), vertices);
  EXPECT_EQ(static_cast<vtkIdType>(ply.polygons.size()), triangles);
  // float rounds the coordinates alike in all formats.
  const auto expectSame = [&](const vtkSmartPointer<vtkPolyData>& mesh, const char* name) {
    SCOPED_TRACE(name);
    ASSERT_EQ(mesh->GetNumberOfPoints(), vertices);
    ASSERT_EQ(mesh->GetNumberOfPolys(), triangles);
    for (vtkIdType v = 0; v < vertices; ++v)
      ASSERT_EQ(Eigen::Map<const Eigen::Vector3d>(mesh->GetPoint(v)).cast<float>(),
                Eigen::Vector3f(cloud[v].getVector3fMap()));
  };
  const auto vtk = outputOf<vtkPolyDataReader>(path("out.vtk"));
  const auto vtp = outputOf<vtkXMLPolyDataReader>(path("out.vtp"));
  expectSame(outputOf<vtkOBJReader>(path("out.obj")), "obj");
  expectSame(vtk, "vtk");
  expectSame(vtp, "vtp");
  const auto stl = outputOf<vtkSTLReader>(path("out.STL"));
  EXPECT_EQ(stl->GetNumberOfPoints(), vertices); // its reader merges equal corners
  EXPECT_EQ(stl->GetNumberOfPolys(), triangles);

  for (const auto& mesh : {vtk, vtp}) {
    vtkDataArray* scalars = mesh->GetPointData()->GetScalars();
    vtkDataArray* confidence = mesh->GetPointData()->GetArray("confidence");
    vtkDataArray* normals = mesh->GetPointData()->GetNormals();
    ASSERT_TRUE(scalars != nullptr && confidence != nullptr && normals != nullptr);
    EXPECT_EQ(scalars->GetDataType(), VTK_UNSIGNED_CHAR);
    EXPECT_EQ(scalars->GetNumberOfComponents(), 3);
    EXPECT_EQ(confidence->GetNumberOfTuples(), vertices);
    EXPECT_GE(confidence->GetRange()[0], 0);
    EXPECT_GT(confidence->GetRange()[1], .5);
    EXPECT_LE(confidence->GetRange()[1], 1);
    for (vtkIdType v = 0; v < vertices; ++v) {
      // The color of the points, red growing with z; a vertex is less than two edges of .3 from what it mixes.
      ASSERT_NEAR(scalars->GetComponent(v, 0), 127 * (mesh->GetPoint(v)[2] + 1), 127 * .6);
      ASSERT_EQ(scalars->GetComponent(v, 2), 200);
      ASSERT_GT(Eigen::Map<const Eigen::Vector3d>(normals->GetTuple3(v))
                    .dot(Eigen::Map<const Eigen::Vector3d>(mesh->GetPoint(v))),
                .9);
    }
  }
}

TEST_F(ToolFiles, TheClassMakesTheSameMesh)
{
  const auto input = coloredSphere(4).makeShared();
  pcl::io::savePCDFileBinary(path("in.pcd").string(), *input);
  succeed({"in.pcd", "out.ply", "-q"});
  const pcl::PolygonMesh byTool = plyOf("out.ply");
  pcl::PolygonMesh byClass;
  pcl::MRFReconstruction<pcl::PointXYZRGBNormal> mrf;
  mrf.setInputCloud(input);
  mrf.reconstruct(byClass);
  const pcl::mrf::TriangleMesh ofClass = conversion::plain(byClass);
  ASSERT_FALSE(ofClass.triangles.empty());
  EXPECT_TRUE(conversion::sameBytes(conversion::plain(byTool), ofClass));
  const auto toolColors = verticesOf<pcl::PointXYZRGB>(byTool), classColors = verticesOf<pcl::PointXYZRGB>(byClass);
  for (std::size_t v = 0; v < classColors.size(); ++v)
    ASSERT_EQ(toolColors[v].rgba & 0xffffff, classColors[v].rgba & 0xffffff);
}

TEST_F(ToolFiles, IntensitySurvives)
{
  pcl::PointCloud<pcl::PointXYZI> input;
  for (const Eigen::Vector3d& p : tool::spherePoints(pointCount)) {
    pcl::PointXYZI point;
    point.getVector3fMap() = p.cast<float>();
    point.intensity = static_cast<float>(10 + p.z());
    input.push_back(point);
  }
  pcl::io::savePCDFileBinary(path("in.pcd").string(), input);
  succeed({"in.pcd", "out.ply", "-q"});
  const auto output = verticesOf<pcl::PointXYZI>(plyOf("out.ply"));
  ASSERT_GT(output.size(), 100u);
  for (const pcl::PointXYZI& point : output)
    ASSERT_NEAR(point.intensity, 10 + point.z, .6); // two edges of .3
}

TEST_F(ToolFiles, FieldIsInTheFrameOfTheCloud)
{
  const Eigen::Vector3d center(300, -200, 100);
  write("in.xyz", tool::sphereRows(pointCount, 2, center));
  const tool::Outcome outcome = succeed({"in.xyz", "out.ply", "--field", "field.vti", "--observation", "plane"});
  const auto image = readField("field.vti");
  vtkDataArray* distance = image->GetPointData()->GetArray("distance");
  vtkDataArray* confidence = image->GetPointData()->GetArray("confidence");
  ASSERT_TRUE(distance != nullptr && confidence != nullptr);
  const double voxel = image->GetSpacing()[0];
  int checked = 0;
  for (vtkIdType i = 0; i < image->GetNumberOfPoints(); ++i) {
    const double truth = (Eigen::Map<const Eigen::Vector3d>(image->GetPoint(i)) - center).norm() - 1;
    if (confidence->GetTuple1(i) < .5)
      continue;
    ++checked;
    // Near the points the field is the distance but for the curvature over a voxel.
    ASSERT_NEAR(distance->GetTuple1(i), truth, .25 * voxel);
  }
  EXPECT_GT(checked, 100);
}

TEST_F(ToolFiles, APieceFarAwayHasAFieldOfItsOwn)
{
  const Eigen::Vector3d far(0, 300, 0);
  write("in.xyz", tool::sphereRows(pointCount) + tool::sphereRows(pointCount / 2, 2, far));
  const tool::Outcome outcome = succeed({"in.xyz", "out.ply", "--field", "field.vti"});
  EXPECT_NE(outcome.out.find("2 pieces far apart"), std::string::npos) << outcome.out;
  for (const bool isFar : {false, true}) {
    double bounds[6];
    readField(isFar ? "field.2.vti" : "field.vti")->GetBounds(bounds);
    EXPECT_NEAR((bounds[2] + bounds[3]) / 2, isFar ? far.y() : 0, .5) << "a box around the sphere of radius 1";
    EXPECT_LT(bounds[3] - bounds[2], 6);
  }
}

TEST_F(ToolFiles, ScenesHoldTheSameMeshWithItsColors)
{
  pcl::io::savePCDFileBinary(path("in.pcd").string(), coloredSphere());
  succeed({"in.pcd", "out.ply", "-q"});
  const pcl::PolygonMesh ply = plyOf("out.ply");
  const auto cloud = verticesOf<pcl::PointXYZRGBNormal>(ply);
  for (const std::string format : {"glb", "dae", "3mf"}) {
    SCOPED_TRACE(format);
    succeed({"in.pcd", "out." + format, "-q"});
    Assimp::Importer importer;
    const aiScene* const scene = importer.ReadFile(path("out." + format).string(), 0);
    ASSERT_NE(scene, nullptr) << importer.GetErrorString();
    ASSERT_EQ(scene->mNumMeshes, 1u);
    const aiMesh& mesh = *scene->mMeshes[0];
    ASSERT_EQ(mesh.mNumFaces, ply.polygons.size());
    ASSERT_EQ(mesh.HasVertexColors(0), format != "3mf");
    for (unsigned t = 0; t < mesh.mNumFaces; ++t)
      for (std::size_t corner = 0; corner < 3; ++corner) {
        // Their readers may number vertices anew.
        const unsigned v = mesh.mFaces[t].mIndices[corner];
        const auto& expected = cloud[ply.polygons[t].vertices[corner]];
        const aiVector3D& position = mesh.mVertices[v];
        ASSERT_LT((Eigen::Vector3f(position.x, position.y, position.z) - expected.getVector3fMap()).norm(),
                  format == "glb" ? 0x1p-60f : 1e-5f); // the others are text of six digits
        if (!mesh.HasVertexColors(0))
          continue;
        // By eye, the middle of the scale is a fifth of its light.
        const float red = mesh.mColors[0][v].r, share = static_cast<float>(expected.r) / 255;
        ASSERT_NEAR(red, format == "glb" ? std::pow(share, 2.2f) : share, format == "glb" ? .01 : .001);
      }
  }
}

TEST_F(ToolFiles, SurveyCoordinatesKeepTheirDigits)
{
  // Float resolves .06 at a million; the sphere's radius is 1.
  const Eigen::Vector3d center(1234567.25, 7654321.5, 321);
  write("in.xyz", tool::sphereRows(pointCount, 2, center));
  for (const char* name : {"out.vtp", "out.obj"}) {
    const tool::Outcome outcome = succeed({"in.xyz", name});
    EXPECT_EQ(outcome.err, "");
  }
  const auto mesh = outputOf<vtkXMLPolyDataReader>(path("out.vtp"));
  ASSERT_GT(mesh->GetNumberOfPoints(), 100);
  for (vtkIdType v = 0; v < mesh->GetNumberOfPoints(); ++v)
    // A fifth of a voxel of .3.
    ASSERT_NEAR((Eigen::Map<const Eigen::Vector3d>(mesh->GetPoint(v)) - center).norm(), 1, .06);
  EXPECT_NE(tool::readText(path("out.obj")).find("v 123456"), std::string::npos);
}

// PCL's reader takes coordinates in double for zero.
TEST_F(ToolFiles, PclReadsAMeshAFewSizesFromTheOrigin)
{
  const Eigen::Vector3d center(0, 0, 20);
  std::ostringstream rows;
  for (const Eigen::Vector3d& position : clouds::spherePoints(pointCount))
    rows << (center + position).transpose() << '\n';
  write("in.xyz", rows.str());
  succeed({"in.xyz", "out.ply"});
  pcl::PointCloud<pcl::PointXYZ> vertices;
  ASSERT_EQ(pcl::io::loadPLYFile(path("out.ply"), vertices), 0);
  for (const pcl::PointXYZ& vertex : vertices)
    ASSERT_NEAR((vertex.getVector3fMap().cast<double>() - center).norm(), 1, .05);
}

TEST_F(ToolFiles, SigmaIsInEveryFormatThatHoldsFields)
{
  write("in.xyz", tool::sphereRows(2000, .75));
  const json report = reportOf({"in.xyz", "out.ply", "--uncertainty", "--samples", "3"});
  const json& uncertainty = report.at("uncertainty");
  EXPECT_EQ(uncertainty.at("samples"), 3);
  EXPECT_GT(uncertainty.at("/fillings/vertices"_json_pointer), 0) << "the hole above z = .75";
  EXPECT_GT(uncertainty.at("/fillings/median"_json_pointer), uncertainty.at("/measured/median"_json_pointer));
  const tool::Outcome told = succeed({"in.xyz", "again.ply", "--uncertainty"});
  EXPECT_NE(told.out.find("with 95 % probability"), std::string::npos) << told.out;

  for (const char* name : {"sigma", "sigma_calibrated"})
    EXPECT_TRUE(conversion::hasField(plyOf("out.ply"), name)) << name;
  for (const char* name : {"out.vtk", "out.vtp"}) {
    succeed({"in.xyz", name, "-q", "--color", "sigma"});
    const auto mesh = std::string(name) == "out.vtk" ? outputOf<vtkPolyDataReader>(path(name))
                                                     : outputOf<vtkXMLPolyDataReader>(path(name));
    vtkDataArray* sigma = mesh->GetPointData()->GetArray("sigma");
    ASSERT_NE(sigma, nullptr) << name;
    EXPECT_EQ(sigma->GetNumberOfTuples(), mesh->GetNumberOfPoints());
    EXPECT_GT(sigma->GetRange()[0], 0);
    EXPECT_EQ(mesh->GetPointData()->GetScalars()->GetNumberOfComponents(), 3) << "colors";
  }
  EXPECT_FALSE(reportOf({"in.xyz", "plain.ply"}).contains("uncertainty"));
  expectFailure({"in.xyz", "no.ply", "--uncertainty", "--observation", "plane"}, 2, "--observation points");
  expectFailure({"in.xyz", "no.ply", "--samples", "4"}, 2, "--samples has a meaning with --uncertainty");
}

TEST_F(ToolFiles, SurfacesThatSigmaAllowsFor)
{
  write("in.xyz", tool::sphereRows(2000, .75));
  const json report = reportOf({"in.xyz", "out.ply", "--write-samples", "2"});
  EXPECT_EQ(files(),
            (std::vector<std::string>{"in.xyz", "out.ply", "out.sample-1.ply", "out.sample-2.ply", "report.json"}));
  const json& shape = report.at("/uncertainty/shape"_json_pointer);
  EXPECT_EQ(shape.at("surfaces"), 8) << "all draws are measured";
  const json& volume = shape.at("volume");
  EXPECT_LT(volume.at("lower"), volume.at("mean"));
  EXPECT_GT(volume.at("upper"), volume.at("mean"));
  EXPECT_LT(volume.at("lower"), 4 * M_PI / 3);
  EXPECT_GT(volume.at("upper"), 4 * M_PI / 3) << "what the cap lacks is in the interval";
  EXPECT_EQ(shape.at("extent").size(), 3u);

  const pcl::PolygonMesh mesh = plyOf("out.ply"), first = plyOf("out.sample-1.ply");
  ASSERT_EQ(first.polygons.size(), mesh.polygons.size());
  const auto before = verticesOf<pcl::PointNormal>(mesh);
  const auto after = verticesOf<pcl::PointXYZ>(first);
  ASSERT_EQ(before.size(), after.size());
  double moved = 0;
  for (std::size_t v = 0; v < before.size(); ++v) {
    const Eigen::Vector3f step = after[v].getVector3fMap() - before[v].getVector3fMap();
    EXPECT_LT(step.cross(before[v].getNormalVector3fMap()).norm(), 1e-5) << "along the normal; floats";
    moved = std::max(moved, static_cast<double>(step.norm()));
  }
  EXPECT_GT(moved, 1e-3);
  EXPECT_NE(first.cloud.data, plyOf("out.sample-2.ply").cloud.data);

  succeed({"in.xyz", "out.obj", "--write-samples", "1", "-q"});
  EXPECT_TRUE(std::filesystem::exists(path("out.sample-1.obj")));
  const tool::Outcome open = run({"in.xyz", "open.ply", "--uncertainty", "--trim", "supported"});
  EXPECT_NE(open.out.find("there is no volume: the mesh is open"), std::string::npos) << open.out;
}

TEST_F(ToolFiles, SurfacesAreAllThereOrNone)
{
  write("in.xyz", tool::sphereRows(500));
  std::filesystem::create_directory(path("out.sample-3.ply"));
  expectFailure({"in.xyz", "out.ply", "--write-samples", "3"}, 1, "'out.sample-3.ply': is a directory");
  expectFailure({"in.xyz", "-", "--output-format", "obj", "--write-samples", "1"}, 2, "standard output holds one mesh");
  expectFailure({"in.xyz", "out.ply", "--write-samples", "1", "--observation", "plane"}, 2, "--observation points");
  std::filesystem::rename(path("in.xyz"), path("mesh.sample-1.ply"));
  expectFailure({"mesh.sample-1.ply", "mesh.ply", "--input-format", "xyz", "--write-samples", "1"}, 2,
                "is an input and would be overwritten");
}

TEST_F(ToolFiles, ReportHoldsEverything)
{
  write("in.xyz", tool::sphereRows(2000, .75));
  const json report = reportOf({"in.xyz", "out.ply"});
  EXPECT_EQ(report.at("status"), "ok");
  EXPECT_EQ(report.at("output"), "out.ply");
  // No value is left at 0 for "automatic" where one is derived for every cloud.
  for (const char* pointer : {"/options/multiscale/voxelSize", "/options/observation/maxDistance", "/density/spacing",
                              "/diagonal", "/smoothingLength", "/mesh/area", "/seconds", "/peakBytes", "/threads"})
    EXPECT_GT(report.at(json::json_pointer(pointer)), 0) << pointer;
  EXPECT_GE(report.at("levels").size(), 1u);
  EXPECT_EQ(report.at("/levels/0/solve/history"_json_pointer).size(),
            report.at("/levels/0/solve/iterations"_json_pointer).get<std::size_t>());
  EXPECT_EQ(report.at("/trimming/holesFilled"_json_pointer), 1); // the hole above z = .75
}

TEST_F(ToolFiles, AFailureIsReportedAsWell)
{
  write("in.xyz", tool::sphereRows(pointCount));
  write("two.xyz", "0 0 0\n1 0 0\n");
  const auto reported = [&](const std::vector<std::string>& arguments, int status) {
    const tool::Outcome outcome = run(tool::with(arguments, {"--report", "r.json", "--field", "f.vti"}));
    EXPECT_EQ(outcome.status, status) << outcome.err;
    EXPECT_EQ(files(), (std::vector<std::string>{"in.xyz", "r.json", "two.xyz"}));
    const json report = parsed("r.json");
    const std::string message = report.at("message"); // calls options as the report does
    EXPECT_NE(outcome.err.find(pcl::mrf::withOptionNames(message, pcl::mrf::OptionNaming::flags)), std::string::npos)
        << message;
    std::filesystem::remove(path("r.json"));
    return report;
  };
  const json large = reported({"in.xyz", "out.ply", "--voxel-size", "0.001", "--max-memory", "16"}, 3);
  EXPECT_EQ(large.at("status"), "resource limit");
  EXPECT_EQ(large.at("schema"), 3);
  EXPECT_EQ(large.at("tool"), "pcl_mrf_reconstruction");
  EXPECT_FALSE(large.at("version").get<std::string>().empty());
  EXPECT_EQ(large.at("/points/used"_json_pointer), pointCount) << "what was done up to there";
  EXPECT_GT(large.at("seconds"), 0);
  EXPECT_GT(large.at("peakBytes"), 0);
  EXPECT_EQ(reported({"two.xyz", "out.ply"}, 1).at("status"), "invalid input");
  EXPECT_EQ(reported({"absent.xyz", "out.ply", "--max-hole", ".5"}, 1).at("/options/trimming/maxHole"_json_pointer),
            .5);
  EXPECT_EQ(reported({"two.xyz", "out.ply", "--normals", "use"}, 2).at("status"), "invalid option");
}

/// A mesh by the bytes of its vertices with all their fields.
struct MeshBytes {
  std::vector<std::string> vertices, triangles;
  Eigen::AlignedBox3d box;

  explicit MeshBytes(const pcl::PolygonMesh& mesh)
  {
    const bool areDoubles = mesh.cloud.fields.at(0).datatype == pcl::PCLPointField::FLOAT64;
    for (std::size_t at = 0; at < mesh.cloud.data.size(); at += mesh.cloud.point_step) {
      const auto* const bytes = reinterpret_cast<const char*>(&mesh.cloud.data[at]);
      vertices.emplace_back(bytes, mesh.cloud.point_step);
      Eigen::Vector3f single;
      Eigen::Vector3d position;
      std::memcpy(single.data(), bytes, sizeof(single));
      std::memcpy(position.data(), bytes, sizeof(position));
      box.extend(areDoubles ? position : single.cast<double>().eval());
    }
    for (const pcl::Vertices& polygon : mesh.polygons) {
      triangles.emplace_back();
      for (const auto vertex : polygon.vertices)
        triangles.back() += vertices.at(vertex);
    }
  }
};

TEST_F(ToolFiles, WhatKilledRunsWereWritingGoes)
{
  write("in.xyz", tool::sphereRows(pointCount));
  write(".out.999999999.part.ply", "of a process that is gone");
  write(".out.1.part.ply", "of one that is there");
  write(".outer.999999999.part.ply", "of another output");
  succeed({"in.xyz", "out.ply"});
  EXPECT_EQ(files(), (std::vector<std::string>{".out.1.part.ply", ".outer.999999999.part.ply", "in.xyz", "out.ply"}));
}

TEST_F(ToolFiles, TilesJoinToTheMesh)
{
  pcl::io::savePCDFileBinary(path("colored.pcd").string(), coloredSphere());
  std::string survey = "x y z nx ny nz intensity\n";
  for (const std::string& row : tool::linesOf(tool::sphereRows(pointCount, 2, {1234567.25, 7654321.5, 321})))
    survey += row + " " + std::to_string(survey.size()) + "\n";
  write("survey.xyz", survey);
  for (const std::string name : {"colored.pcd", "survey.xyz"}) {
    SCOPED_TRACE(name);
    const std::string folder = "new/" + name;
    const json report =
        reportOf({name, "out.ply", "--uncertainty", "--output-tiles", folder, "--tile-triangles", "70"});
    const json index = parsed(folder + "/index.json"), tiles = index.at("tiles");
    EXPECT_EQ(index.at("tool"), "pcl_mrf_reconstruction");
    const int all = report.at("/mesh/triangles"_json_pointer);
    ASSERT_EQ(static_cast<int>(tiles.size()), (all + 69) / 70);
    ASSERT_GT(tiles.size(), 5u);

    MeshBytes mesh(plyOf("out.ply"));
    const std::set<std::string> known(mesh.vertices.begin(), mesh.vertices.end());
    std::vector<std::string> joined;
    for (std::size_t n = 0; n < tiles.size(); ++n) {
      const std::string file = tiles[n].at("file");
      SCOPED_TRACE(file);
      EXPECT_EQ(file, "tile_" + std::string(n < 10 ? "000" : "00") + std::to_string(n) + ".ply");
      const MeshBytes tile(plyOf(folder + "/" + file));
      EXPECT_EQ(tiles[n].at("vertices"), tile.vertices.size());
      EXPECT_EQ(tiles[n].at("triangles"), tile.triangles.size());
      EXPECT_NEAR(static_cast<double>(tile.triangles.size()), all / static_cast<double>(tiles.size()), 3);
      EXPECT_LE(tile.triangles.size(), 70u);
      for (const std::string& vertex : tile.vertices)
        ASSERT_EQ(known.count(vertex), 1u) << "not a vertex of the mesh with all it has";
      EXPECT_EQ(std::set<std::string>(tile.vertices.begin(), tile.vertices.end()).size(), tile.vertices.size());
      joined.insert(joined.end(), tile.triangles.begin(), tile.triangles.end());

      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(tiles[n].at("lower").at(axis), tile.box.min()[axis]);
        EXPECT_EQ(tiles[n].at("upper").at(axis), tile.box.max()[axis]);
      }
      EXPECT_LT(tile.box.diagonal().norm(), 2) << "of a sphere of radius 1 in so many tiles";
    }
    std::sort(mesh.triangles.begin(), mesh.triangles.end());
    std::sort(joined.begin(), joined.end());
    EXPECT_TRUE(joined == mesh.triangles) << "each triangle in one tile";
    EXPECT_EQ(files(folder).size(), tiles.size() + 1) << "they and their index";
  }
  succeed({"colored.pcd", "--output-directory", "meshes", "--output-tiles", "tiles", "-q"});
  EXPECT_EQ(parsed("meshes/colored-tiles/index.json").at("tiles").size(), 1u);
}

TEST_F(ToolFiles, TilesComeIntoAnEmptyFolder)
{
  write("in.xyz", tool::sphereRows(pointCount));
  write("two.xyz", "0 0 0\n1 0 0\n");
  expectFailure({"in.xyz", "out.ply", "--output-tiles", "in.xyz"}, 1, "'in.xyz': cannot be made: Not a directory");
  expectFailure({"in.xyz", "out.ply", "--tile-triangles", "9"}, 2,
                "--tile-triangles: there are no tiles for it; say --o");
  expectFailure({"in.xyz", "out.ply", "--output-tiles", "t", "--tile-triangles", "0"}, 2, "range [1, 2147483648]");
  expectFailure({"two.xyz", "out.ply", "--output-tiles", "made"}, 1, "two.xyz"); // leaves no folder behind
  expectFailure({"in.xyz", "made/out.ply", "--output-tiles", "made"}, 2, "'made/out.ply' is in the folder of tiles");
  std::filesystem::create_directory(path("tiles"));
  expectFailure({"two.xyz", "out.ply", "--output-tiles", "tiles"}, 1, "two.xyz");
  EXPECT_TRUE(std::filesystem::is_empty(path("tiles")));
  const tool::Outcome outcome = succeed({"in.xyz", "out.ply", "--output-tiles", "tiles"});
  EXPECT_NE(outcome.out.find("), tiles, 1 tile ("), std::string::npos) << outcome.out;
  expectFailure({"in.xyz", "out.ply", "--output-tiles", "tiles"}, 1,
                "'tiles': holds files, of an earlier run maybe; delete them, or name another folder");
}

} // namespace
