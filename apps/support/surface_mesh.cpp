// SPDX-License-Identifier: BSD-3-Clause
#include "surface_mesh.h"

#include "float_offset.h"
#include "module.h"
#include "text_file.h"

#include <base/byte_writer.h>
#include <pcl/PCLPointField.h>
#include <pcl/surface/mrf/reconstruction.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <utility>

namespace mrf_apps {
namespace {

/// The mesh as the library's writers see it.
pcl::mrf::MeshView viewOf(const SurfaceMesh& mesh)
{
  using pcl::PCLPointField;
  pcl::mrf::MeshView view;
  view.vertices = mesh.vertices.size();
  view.inSinglePrecision = !mesh.doublePrecision;
  // Adds a field for each component of an array that has an element per vertex.
  const auto add = [&](std::initializer_list<const char*> names, const auto& values, std::uint8_t type) {
    std::size_t offset = 0;
    for (const char* name : names) {
      if (values.size() != mesh.vertices.size())
        continue; // the mesh has none
      const auto* const first = reinterpret_cast<const char*>(values.data());
      view.fields.push_back({name, first + offset, sizeof(values[0]), type});
      offset += sizeof(values[0]) / names.size();
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

/// Shortest text that reads back as the same number.
template <typename T>
std::string decimal(T number)
{
  std::array<char, 32> digits;
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr};
}

void writeObj(const SurfaceMesh& mesh, const std::string& path)
{
  pcl::mrf::ByteWriter file(path);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    std::string line = "v";
    for (const double value : mesh.vertices[v])
      line += " " + (mesh.doublePrecision ? decimal(value) : decimal(static_cast<float>(value)));
    // A common extension of the format: colors 0..1 behind the coordinates.
    if (!mesh.colors.empty())
      for (const std::uint8_t channel : mesh.colors[v])
        line += " " + decimal(static_cast<float>(channel) / 255.f);
    file.text(line + "\n");
  }
  for (const Eigen::Vector3f& normal : mesh.normals)
    file.text("vn " + decimal(normal.x()) + " " + decimal(normal.y()) + " " + decimal(normal.z()) + "\n");
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

/// VTK's writer is not used: it writes no offset.
void writeStl(const SurfaceMesh& mesh, const std::string& path)
{
  const Eigen::Vector3d offset = offsetOfFloats(mesh, "stl");
  pcl::mrf::ByteWriter file(path);
  std::string header = "Markov random field surface reconstruction";
  if (!offset.isZero(0))
    header =
        std::string(stlOffsetMark) + " " + decimal(offset.x()) + " " + decimal(offset.y()) + " " + decimal(offset.z());
  header.resize(80, '\0');
  file.text(header);
  file.value(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles) {
    std::array<Eigen::Vector3f, 3> corners;
    for (std::size_t corner = 0; corner < 3; ++corner)
      corners[corner] = (mesh.vertices[triangle[corner]] - offset).cast<float>();
    const Eigen::Vector3f normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    for (const Eigen::Vector3f& vector : {normal, corners[0], corners[1], corners[2]})
      for (const float value : vector)
        file.value(value);
    file.value(std::uint16_t{0});
  }
  file.close();
}

} // namespace

const std::vector<std::string> meshFormats = {"ply", "obj", "stl", "vtk", "vtp", "glb", "dae", "3mf"};

SurfaceMesh toSurfaceMesh(pcl::mrf::Reconstruction& reconstruction, bool isExact)
{
  SurfaceMesh result;
  result.colors = vertexColors(reconstruction);
  pcl::mrf::TriangleMesh mesh = std::move(reconstruction.mesh);
  result.doublePrecision = isExact;
  result.intensities = std::move(reconstruction.intensities);
  result.vertices.reserve(mesh.vertices.size());
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    result.vertices.emplace_back(vertex.cast<double>() + reconstruction.points.offset);
  result.triangles = std::move(mesh.triangles);
  result.normals = std::move(mesh.normals);
  result.confidences = std::move(mesh.confidences);
  if (!mesh.sigmas.empty()) {
    result.scalars["sigma"] = std::move(mesh.sigmas);
    result.scalars["sigma_calibrated"].assign(mesh.calibrated.begin(), mesh.calibrated.end());
  }
  return result;
}

const char* const stlOffsetMark = "MRF offset";

Eigen::Vector3d offsetOfFloats(const SurfaceMesh& mesh, const std::string& format)
{
  const bool holdsDoubles = format == "ply" || format == "obj" || format == "vtk" || format == "vtp";
  if (holdsDoubles || !mesh.doublePrecision || mesh.vertices.empty())
    return Eigen::Vector3d::Zero();
  const Eigen::AlignedBox3d box = boxOf(mesh.vertices);
  if (box.isEmpty())
    return Eigen::Vector3d::Zero();
  // Rounded to multiples of a power of ten below the mesh's size: easy to type, and read back without a loss.
  const double step = std::pow(10., std::floor(std::log10(std::max(box.diagonal().norm(), 1e-300))));
  Eigen::Vector3d offset = (box.center() / step).array().round() * step;
  // At most twelve digits, so that three numbers fit into the header of an STL file.
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
         ": its format holds 32-bit floats, too coarse for these coordinates; others, such as ply, obj and vtk, hold "
         "them";
}

bool writeWithoutVtk(const SurfaceMesh& mesh, const std::string& path, const std::string& format)
{
  if (format == "ply")
    pcl::mrf::writePLY(viewOf(mesh), path);
  else if (format == "vtk")
    pcl::mrf::writeVTK(viewOf(mesh), path);
  else if (format == "obj")
    writeObj(mesh, path);
  else if (format == "stl")
    writeStl(mesh, path);
  else if (format == "glb" || format == "dae" || format == "3mf")
    writeText(path, shownBy<SceneWriter>(sceneModule, "sceneWriter", "GLB, DAE and 3MF files")
                        .bytesOf(mesh, offsetOfFloats(mesh, format), format));
  else
    return false;
  return true;
}

} // namespace mrf_apps
