// SPDX-License-Identifier: BSD-3-Clause
// Mesh files, read back by PCL and VTK.
#include "support/conversion.h"

#include <pcl/surface/mrf/triangle_mesh.h>

#include <pcl/console/print.h>
#include <pcl/io/ply_io.h>

#include <vtkCellArray.h>
#include <vtkDataArray.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataReader.h>
#include <vtkSmartPointer.h>

#include <gtest/gtest.h>

#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

using pcl::PCLPointField;

namespace {

namespace fs = std::filesystem;

class MeshFiles : public ::testing::Test {
protected:
  MeshFiles() : folder_(fs::temp_directory_path() / ("mesh_files_" + std::to_string(getpid())))
  {
    fs::create_directory(folder_);
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS); // some are to fail
  }
  ~MeshFiles() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  std::size_t files() const
  {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

private:
  fs::path folder_;
};

/// Appends a field to a cloud that has no points yet. \return its offset
std::size_t addField(pcl::PCLPointCloud2& cloud, const std::string& name, std::uint8_t type, std::uint32_t size)
{
  PCLPointField field;
  field.name = name;
  field.offset = cloud.point_step;
  field.datatype = type;
  field.count = 1;
  cloud.fields.push_back(field);
  cloud.point_step += size;
  return field.offset;
}

constexpr std::size_t vertices = 5;

float valueAt(std::size_t vertex, std::size_t field)
{
  return static_cast<float>(vertex) + .125f * static_cast<float>(field);
}

/// A square and a triangle at its side, with all fields of a reconstruction's output and a label.
pcl::PolygonMesh someMesh()
{
  pcl::PolygonMesh mesh;
  const char* const names[] = {"x", "y", "z", "normal_x", "normal_y", "normal_z", "confidence"};
  for (const char* name : names)
    addField(mesh.cloud, name, PCLPointField::FLOAT32, 4);
  const std::size_t rgb = addField(mesh.cloud, "rgb", PCLPointField::FLOAT32, 4),
                    label = addField(mesh.cloud, "label", PCLPointField::UINT32, 4);
  mesh.cloud.width = vertices;
  mesh.cloud.height = 1;
  mesh.cloud.data.resize(vertices * mesh.cloud.point_step);
  for (std::size_t v = 0; v < vertices; ++v) {
    std::uint8_t* const point = mesh.cloud.data.data() + v * mesh.cloud.point_step;
    for (std::size_t f = 0; f < std::size(names); ++f) {
      const float value = valueAt(v, f);
      std::memcpy(point + 4 * f, &value, 4);
    }
    const auto number = static_cast<std::uint32_t>(v);
    const std::uint32_t color = 0x102000 + number, identity = 70000 + number;
    std::memcpy(point + rgb, &color, 4);
    std::memcpy(point + label, &identity, 4);
  }
  mesh.polygons.resize(2);
  mesh.polygons[0].vertices = {0, 1, 2, 3};
  mesh.polygons[1].vertices = {1, 4, 2};
  return mesh;
}

void setCoordinatesInDouble(pcl::PolygonMesh& mesh, double first)
{
  mesh.cloud = pcl::PCLPointCloud2();
  for (const char* name : {"x", "y", "z"})
    addField(mesh.cloud, name, PCLPointField::FLOAT64, 8);
  mesh.cloud.width = vertices;
  mesh.cloud.height = 1;
  mesh.cloud.data.resize(vertices * mesh.cloud.point_step);
  for (std::size_t n = 0; n < 3 * vertices; ++n) {
    const double value = first + static_cast<double>(n);
    std::memcpy(mesh.cloud.data.data() + 8 * n, &value, 8);
  }
}

vtkSmartPointer<vtkPolyData> readVtk(const std::string& path)
{
  auto reader = vtkSmartPointer<vtkPolyDataReader>::New();
  reader->SetFileName(path.c_str());
  reader->ReadAllScalarsOn();
  reader->Update();
  return reader->GetOutput();
}

std::string contents(const std::string& path)
{
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

} // namespace

TEST_F(MeshFiles, PlyKeepsAllFields)
{
  const pcl::PolygonMesh mesh = someMesh();
  ASSERT_EQ(pcl::mrf::savePLY(path("mesh.ply"), mesh), 0);
  pcl::PolygonMesh read;
  ASSERT_EQ(pcl::io::loadPLYFile(path("mesh.ply"), read), 0);
  ASSERT_EQ(read.cloud.width, vertices);
  for (const char* name : {"x", "y", "z", "normal_x", "normal_y", "normal_z", "confidence"})
    EXPECT_EQ(conversion::values(read.cloud, name), conversion::values(mesh.cloud, name)) << name;
  ASSERT_EQ(read.polygons.size(), 2u);
  EXPECT_EQ(read.polygons[0].vertices, mesh.polygons[0].vertices);
  EXPECT_EQ(read.polygons[1].vertices, mesh.polygons[1].vertices);
  pcl::PointCloud<pcl::PointXYZRGB> colors;
  pcl::fromPCLPointCloud2(read.cloud, colors);
  for (std::size_t v = 0; v < vertices; ++v)
    EXPECT_EQ(colors[v].rgba & 0xffffff, 0x102000u + v);
}

TEST_F(MeshFiles, VtkKeepsAllFields)
{
  pcl::PolygonMesh mesh = someMesh();
  ASSERT_EQ(pcl::mrf::saveVTK(path("mesh.vtk"), mesh), 0);
  const auto read = readVtk(path("mesh.vtk"));
  ASSERT_EQ(read->GetNumberOfPoints(), static_cast<vtkIdType>(vertices));
  ASSERT_EQ(read->GetNumberOfPolys(), 2);
  EXPECT_EQ(read->GetPolys()->GetNumberOfConnectivityIds(), 7);
  vtkPointData* data = read->GetPointData();
  ASSERT_NE(data->GetNormals(), nullptr);
  ASSERT_NE(data->GetScalars(), nullptr);
  ASSERT_NE(data->GetArray("confidence"), nullptr);
  ASSERT_NE(data->GetArray("label"), nullptr);
  EXPECT_EQ(data->GetScalars()->GetDataType(), VTK_UNSIGNED_CHAR);
  for (std::size_t n = 0; n < vertices; ++n) {
    const auto v = static_cast<vtkIdType>(n);
    EXPECT_EQ(read->GetPoint(v)[1], valueAt(n, 1));
    EXPECT_EQ(data->GetNormals()->GetComponent(v, 2), valueAt(n, 5));
    EXPECT_EQ(data->GetArray("confidence")->GetTuple1(v), valueAt(n, 6));
    EXPECT_EQ(data->GetArray("label")->GetTuple1(v), 70000 + static_cast<double>(n));
    EXPECT_EQ(data->GetScalars()->GetComponent(v, 0), 0x10);
    EXPECT_EQ(data->GetScalars()->GetComponent(v, 2), static_cast<double>(n));
  }
  for (pcl::PCLPointField& field : mesh.cloud.fields)
    if (field.name == "rgb")
      field.name = "other";
  ASSERT_EQ(pcl::mrf::saveVTK(path("mesh.vtk"), mesh), 0);
  EXPECT_EQ(readVtk(path("mesh.vtk"))->GetPointData()->GetScalars(), nullptr) << "of one color in viewers";
}

TEST_F(MeshFiles, SurveyCoordinatesKeepTheirDigitsAndAnEmptyMeshIsAFile)
{
  pcl::PolygonMesh mesh = someMesh();
  setCoordinatesInDouble(mesh, 4500123.0009765625);
  ASSERT_EQ(pcl::mrf::saveVTK(path("mesh.vtk"), mesh), 0);
  EXPECT_EQ(readVtk(path("mesh.vtk"))->GetPoint(0)[0], 4500123.0009765625);
  ASSERT_EQ(pcl::mrf::savePLY(path("mesh.ply"), mesh), 0);
  const std::string bytes = contents(path("mesh.ply"));
  EXPECT_NE(bytes.find("property double x"), std::string::npos);
  double first;
  std::memcpy(&first, bytes.data() + bytes.find("end_header\n") + 11, 8);
  EXPECT_EQ(first, 4500123.0009765625);

  mesh.cloud.width = 0;
  mesh.cloud.data.clear();
  mesh.polygons.clear();
  ASSERT_EQ(pcl::mrf::savePLY(path("mesh.ply"), mesh), 0);
  EXPECT_NE(contents(path("mesh.ply")).find("element vertex 0\n"), std::string::npos);
  ASSERT_EQ(pcl::mrf::saveVTK(path("mesh.vtk"), mesh), 0);
  EXPECT_EQ(readVtk(path("mesh.vtk"))->GetNumberOfPoints(), 0);
}

TEST_F(MeshFiles, AreWholeOrNotThere)
{
  std::ofstream(path("old.ply")) << "before";
  pcl::PolygonMesh broken = someMesh();
  broken.polygons[1].vertices[1] = vertices;
  EXPECT_LT(pcl::mrf::savePLY(path("old.ply"), broken), 0);
  EXPECT_EQ(contents(path("old.ply")), "before") << "what was there stays";
  EXPECT_LT(pcl::mrf::saveVTK(path("new.vtk"), broken), 0);
  pcl::PolygonMesh flat = someMesh();
  flat.cloud.fields[2].name = "elevation";
  EXPECT_LT(pcl::mrf::savePLY(path("new.ply"), flat), 0);
  pcl::PolygonMesh torn = someMesh();
  torn.cloud.fields.back().offset = torn.cloud.point_step;
  EXPECT_LT(pcl::mrf::savePLY(path("new.ply"), torn), 0) << "the last point would be read beyond its end";
  EXPECT_LT(pcl::mrf::savePLY(path("missing/mesh.ply"), someMesh()), 0);
  EXPECT_EQ(files(), 1u) << "nothing is left of the attempts";

  fs::create_symlink("old.ply", path("link.ply"));
  ASSERT_EQ(pcl::mrf::savePLY(path("link.ply"), someMesh()), 0);
  EXPECT_TRUE(fs::is_symlink(path("link.ply")));
  EXPECT_EQ(contents(path("old.ply")), contents(path("link.ply")));
  EXPECT_EQ(contents(path("old.ply")).substr(0, 4), "ply\n");
  EXPECT_LT(pcl::mrf::savePLY("/dev/full", someMesh()), 0) << "no room";
}
