// SPDX-License-Identifier: BSD-3-Clause
#include "surface_mesh.h"
#include "byte_writer.h"
#include "errors.h"
#include "poly_data.h"
#include "text_file.h"

#include <pcl/surface/mrf/triangle_mesh.h>

#include <pcl/common/io.h>
#include <pcl/PCLPointCloud2.h>

#include <vtkXMLPolyDataWriter.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

namespace mrf_apps {
namespace {

/// Offset of a 4-byte field in a packed point, −1 if it is not there.
int fieldOffset(const pcl::PCLPointCloud2& cloud, const std::string& name)
{
  for (const pcl::PCLPointField& field : cloud.fields)
    if (field.name == name)
      return static_cast<int>(field.offset);
  return -1;
}

float floatAt(const std::uint8_t* bytes)
{
  float value;
  std::memcpy(&value, bytes, sizeof(value));
  return value;
}

/// The mesh as the library's writers see it.
pcl::mrf::MeshView viewOf(const SurfaceMesh& mesh)
{
  using pcl::PCLPointField;
  pcl::mrf::MeshView view;
  view.vertices = mesh.vertices.size();
  view.inSinglePrecision = !mesh.doublePrecision;
  // Consecutive components, one field each, of an array with an element per vertex.
  const auto add = [&](std::initializer_list<const char*> names, const auto& values, std::uint8_t type) {
    std::size_t offset = 0;
    for (const char* name : names) {
      if (values.size() != mesh.vertices.size())
        continue; // the mesh has none
      const auto* const first = reinterpret_cast<const char*>(values.data());
      view.fields.push_back({name, first + offset, sizeof(values[0]), type});
      offset += static_cast<std::size_t>(pcl::getFieldSize(type));
    }
  };
  add({"x", "y", "z"}, mesh.vertices, PCLPointField::FLOAT64);
  add({"nx", "ny", "nz"}, mesh.normals, PCLPointField::FLOAT32);
  add({"red", "green", "blue"}, mesh.colors, PCLPointField::UINT8);
  add({"intensity"}, mesh.intensities, PCLPointField::FLOAT32);
  add({"confidence"}, mesh.confidences, PCLPointField::FLOAT32);
  for (const auto& [name, values] : mesh.scalars)
    add({name.c_str()}, values, PCLPointField::FLOAT32);
  view.polygons = mesh.triangles.size();
  view.corners = [&mesh](std::size_t triangle, std::vector<std::int32_t>& corners) {
    corners.assign(mesh.triangles[triangle].begin(), mesh.triangles[triangle].end());
  };
  return view;
}

void writeObj(const SurfaceMesh& mesh, const std::string& path)
{
  ByteWriter file(path);
  const auto coordinate = [&](double value) {
    file.text(" ");
    if (mesh.doublePrecision)
      file.decimal(value);
    else
      file.decimal(static_cast<float>(value));
  };
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    file.text("v");
    for (int axis = 0; axis < 3; ++axis)
      coordinate(mesh.vertices[v][axis]);
    // The widespread extension: colors 0..1 behind the coordinates.
    if (!mesh.colors.empty())
      for (const std::uint8_t channel : mesh.colors[v]) {
        file.text(" ");
        file.decimal(static_cast<float>(channel) / 255.f);
      }
    file.text("\n");
  }
  for (const Eigen::Vector3f& normal : mesh.normals) {
    file.text("vn");
    for (int axis = 0; axis < 3; ++axis) {
      file.text(" ");
      file.decimal(normal[axis]);
    }
    file.text("\n");
  }
  for (const auto& triangle : mesh.triangles) {
    file.text("f");
    for (const std::int32_t vertex : triangle) {
      const std::string index = std::to_string(vertex + 1);
      file.text(" " + index);
      if (!mesh.normals.empty())
        file.text("//" + index);
    }
    file.text("\n");
  }
  file.close();
}

/// Not VTK's writer, which knows no offset.
void writeStl(const SurfaceMesh& mesh, const std::string& path)
{
  const Eigen::Vector3d offset = stlOffset(mesh);
  ByteWriter file(path);
  std::string header = "Markov random field surface reconstruction";
  if (!offset.isZero(0)) {
    header = stlOffsetMark;
    for (const double value : offset) {
      std::array<char, 32> digits;
      header += " ";
      header.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
    }
  }
  header.resize(80, '\0');
  file.text(header);
  file.value(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles) {
    std::array<Eigen::Vector3f, 3> corners;
    for (std::size_t corner = 0; corner < 3; ++corner)
      corners[corner] = (mesh.vertices[static_cast<std::size_t>(triangle[corner])] - offset).cast<float>();
    const Eigen::Vector3f normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    for (const Eigen::Vector3f& vector : {normal, corners[0], corners[1], corners[2]})
      for (const float value : vector)
        file.value(value);
    file.value(std::uint16_t{0});
  }
  file.close();
}

} // namespace

const char* const meshFileExtensions = "ply, obj, stl, vtk or vtp";

SurfaceMesh toSurfaceMesh(pcl::mrf::TriangleMesh mesh, const Eigen::Vector3d& offset)
{
  SurfaceMesh result;
  result.vertices.reserve(mesh.vertices.size());
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    result.vertices.emplace_back(vertex.cast<double>() + offset);
  result.triangles = std::move(mesh.triangles);
  result.normals = std::move(mesh.normals);
  result.confidences = std::move(mesh.confidences);
  if (!mesh.sigmas.empty()) {
    result.scalars["sigma"] = std::move(mesh.sigmas);
    result.scalars["sigma_calibrated"].assign(mesh.calibrated.begin(), mesh.calibrated.end());
  }
  return result;
}

SurfaceMesh toSurfaceMesh(const pcl::PolygonMesh& mesh, const Eigen::Vector3d& offset)
{
  const pcl::PCLPointCloud2& cloud = mesh.cloud;
  const std::size_t count = std::size_t{cloud.width} * cloud.height;
  SurfaceMesh result;
  result.doublePrecision = !offset.isZero(0);
  const auto forEach = [&](const char* name, auto& values, auto&& read) {
    const int position = fieldOffset(cloud, name);
    if (position < 0)
      return;
    values.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
      values.push_back(read(cloud.data.data() + i * cloud.point_step + position));
  };
  // The three coordinates of a position or a normal lie one behind the other.
  const auto vectorAt = [](const std::uint8_t* p) {
    return Eigen::Vector3f(floatAt(p), floatAt(p + 4), floatAt(p + 8));
  };
  forEach("x", result.vertices,
          [&](const std::uint8_t* p) -> Eigen::Vector3d { return vectorAt(p).cast<double>() + offset; });
  forEach("normal_x", result.normals, vectorAt);
  forEach("rgb", result.colors, [](const std::uint8_t* p) { return std::array<std::uint8_t, 3>{p[2], p[1], p[0]}; });
  forEach("intensity", result.intensities, floatAt);
  forEach("confidence", result.confidences, floatAt);
  result.triangles.reserve(mesh.polygons.size());
  for (const pcl::Vertices& polygon : mesh.polygons)
    result.triangles.push_back({static_cast<std::int32_t>(polygon.vertices[0]),
                                static_cast<std::int32_t>(polygon.vertices[1]),
                                static_cast<std::int32_t>(polygon.vertices[2])});
  return result;
}

const char* const stlOffsetMark = "MRF offset";

Eigen::Vector3d stlOffset(const SurfaceMesh& mesh)
{
  if (!mesh.doublePrecision || mesh.vertices.empty())
    return Eigen::Vector3d::Zero();
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    if (vertex.allFinite())
      box.extend(vertex);
  if (box.isEmpty())
    return Eigen::Vector3d::Zero();
  // Rounded to a power of ten below the mesh's size: easy to type, and found again without a loss.
  const double step = std::pow(10., std::floor(std::log10(std::max(box.diagonal().norm(), 1e-300))));
  Eigen::Vector3d offset = (box.center() / step).array().round() * step;
  // Twelve digits at most, so that three fit into the header of a file.
  for (double& value : offset) {
    std::array<char, 32> digits;
    std::snprintf(digits.data(), digits.size(), "%.11e", value);
    toNumber(digits.data(), value);
  }
  return offset;
}

std::string shiftWarning(const std::string& path, const Eigen::Vector3d& offset)
{
  std::array<char, 160> position;
  std::snprintf(position.data(), position.size(), "(%.12g, %.12g, %.12g)", offset.x(), offset.y(), offset.z());
  return "'" + path + "' is written relative to " + position.data() +
         ": STL holds 32-bit floats, too coarse for these coordinates; ply, obj, vtk and vtp hold them";
}

const std::vector<std::string>& meshFormats()
{
  static const std::vector<std::string> all = {"ply", "obj", "stl", "vtk", "vtp"};
  return all;
}

bool isMeshFormat(const std::string& extension)
{
  return std::find(meshFormats().begin(), meshFormats().end(), extension) != meshFormats().end();
}

void writeMesh(const SurfaceMesh& mesh, const std::string& path, const std::string& format)
{
  if (format == "ply" || format == "vtk") {
    try {
      return format == "ply" ? pcl::mrf::writePLY(viewOf(mesh), path) : pcl::mrf::writeVTK(viewOf(mesh), path);
    } catch (const pcl::mrf::FileError& error) {
      throw FileError(error.what());
    }
  }
  if (format == "obj")
    return writeObj(mesh, path);
  if (format == "stl")
    return writeStl(mesh, path);
  if (format != "vtp")
    throw UsageError("'" + path + "': mesh files end in " + meshFileExtensions);
  auto writer = vtkSmartPointer<vtkXMLPolyDataWriter>::New();
  writer->SetInputData(toPolyData(mesh));
  writer->WriteToOutputStringOn(); // VTK would not tell why a file cannot be written
  writer->Write();
  writeText(path, writer->GetOutputString());
}

} // namespace mrf_apps
