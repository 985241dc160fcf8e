// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/triangle_mesh.h>

#include "base/byte_writer.h"

#include <pcl/common/io.h>
#include <pcl/console/print.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <filesystem>
#include <system_error>

namespace pcl::mrf {
namespace {

namespace fs = std::filesystem;

/// How the values of a type are written.
struct FieldType {
  std::uint8_t type;     ///< of pcl::PCLPointField
  const char *ply, *vtk; ///< names in the files
  void (*write)(const char* value, ByteWriter& file);
};

template <typename Stored, typename Written = Stored>
void write(const char* value, ByteWriter& file)
{
  Stored number;
  std::memcpy(&number, value, sizeof(number));
  file.value(static_cast<Written>(number));
}

/// Files have no integers of 64 bits: they become doubles.
const FieldType& typeOf(const VertexField& field, bool inSinglePrecision)
{
  using Field = PCLPointField;
  static constexpr FieldType rounded{Field::FLOAT64, "float", "float", &write<double, float>};
  static constexpr std::array<FieldType, 11> all = {{{Field::BOOL, "uchar", "unsigned_char", &write<std::uint8_t>},
                                                     {Field::INT8, "char", "char", &write<std::int8_t>},
                                                     {Field::UINT8, "uchar", "unsigned_char", &write<std::uint8_t>},
                                                     {Field::INT16, "short", "short", &write<std::int16_t>},
                                                     {Field::UINT16, "ushort", "unsigned_short", &write<std::uint16_t>},
                                                     {Field::INT32, "int", "int", &write<std::int32_t>},
                                                     {Field::UINT32, "uint", "unsigned_int", &write<std::uint32_t>},
                                                     {Field::INT64, "double", "double", &write<std::int64_t, double>},
                                                     {Field::UINT64, "double", "double", &write<std::uint64_t, double>},
                                                     {Field::FLOAT32, "float", "float", &write<float>},
                                                     {Field::FLOAT64, "double", "double", &write<double>}}};
  if (inSinglePrecision && field.type == rounded.type)
    return rounded;
  const auto found = std::find_if(all.begin(), all.end(), [&](const FieldType& row) { return row.type == field.type; });
  if (found == all.end())
    throw FileError("cannot be written: field '" + field.name + "' is of an unknown type");
  return *found;
}

/// Writes the values of some fields, vertex by vertex.
template <typename Fields>
void writeValues(const MeshView& mesh, const Fields& fields, ByteWriter& file)
{
  std::vector<const FieldType*> types;
  for (const VertexField* field : fields)
    types.push_back(&typeOf(*field, mesh.inSinglePrecision));
  for (std::size_t v = 0; v < mesh.vertices; ++v)
    for (std::size_t f = 0; f < types.size(); ++f)
      types[f]->write(static_cast<const char*>(fields[f]->values) + v * fields[f]->stride, file);
}

/// Calls visit(corners) for each polygon. \throw FileError if a corner is no vertex of the mesh
template <typename Visit>
void forPolygons(const MeshView& mesh, const Visit& visit)
{
  std::vector<std::int32_t> corners;
  for (std::size_t p = 0; p < mesh.polygons; ++p) {
    mesh.corners(p, corners);
    for (const std::int32_t vertex : corners)
      if (vertex < 0 || static_cast<std::size_t>(vertex) >= mesh.vertices)
        throw FileError("cannot be written: polygon " + std::to_string(p) + " has vertex " + std::to_string(vertex) +
                        ", and the mesh " + std::to_string(mesh.vertices));
    visit(corners);
  }
}

const VertexField* find(const MeshView& mesh, const std::string& name)
{
  const auto found = std::find_if(mesh.fields.begin(), mesh.fields.end(),
                                  [&](const VertexField& field) { return field.name == name; });
  return found == mesh.fields.end() ? nullptr : &*found;
}

using Triple = std::array<const VertexField*, 3>;

/// Three fields that belong together; all nullptr if one is missing or their types differ.
Triple findAll(const MeshView& mesh, const std::array<const char*, 3>& names)
{
  const Triple fields = {find(mesh, names[0]), find(mesh, names[1]), find(mesh, names[2])};
  const bool areThere = std::find(fields.begin(), fields.end(), nullptr) == fields.end();
  return areThere && fields[0]->type == fields[1]->type && fields[0]->type == fields[2]->type ? fields : Triple{};
}

Triple requirePosition(const MeshView& mesh)
{
  const Triple position = findAll(mesh, {"x", "y", "z"});
  if (position[0] == nullptr)
    throw FileError("cannot be written: the mesh's vertices have no x, y and z of one type");
  return position;
}

/// The point data of a VTK file: all fields but the position.
void writePointData(const MeshView& mesh, const Triple& position, ByteWriter& file)
{
  const auto add = [&](const std::string& header, const auto& fields) {
    file.text(header + "\n");
    writeValues(mesh, fields, file);
    file.text("\n");
  };
  Triple colors = findAll(mesh, {"red", "green", "blue"});
  if (colors[0] != nullptr && colors[0]->type != PCLPointField::UINT8)
    colors = {};
  const Triple normals = findAll(mesh, {"nx", "ny", "nz"});
  std::vector<const VertexField*> others;
  for (const VertexField& field : mesh.fields) {
    const auto isIn = [&](const Triple& fields) {
      return std::find(fields.begin(), fields.end(), &field) != fields.end();
    };
    if (!isIn(position) && !isIn(colors) && !isIn(normals))
      others.push_back(&field);
  }
  const auto vertices = std::to_string(mesh.vertices);
  file.text("POINT_DATA " + vertices + "\n");
  if (colors[0] != nullptr)
    add("COLOR_SCALARS rgb 3", colors);
  if (normals[0] != nullptr)
    add(std::string("NORMALS normals ") + typeOf(*normals[0], mesh.inSinglePrecision).vtk, normals);
  // Not as SCALARS, by which viewers would color the mesh.
  if (!others.empty())
    file.text("FIELD FieldData " + std::to_string(others.size()) + "\n");
  for (const VertexField* other : others)
    add(other->name + " 1 " + vertices + " " + typeOf(*other, mesh.inSinglePrecision).vtk, std::array{other});
}

/// PCL's fields under the names that files have for them.
MeshView viewOf(const pcl::PolygonMesh& mesh)
{
  const pcl::PCLPointCloud2& cloud = mesh.cloud;
  MeshView view;
  view.vertices = std::size_t{cloud.width} * cloud.height;
  if (cloud.data.size() < view.vertices * cloud.point_step)
    throw FileError("cannot be written: the mesh's cloud has fewer bytes than its " + std::to_string(view.vertices) +
                    " points take");
  for (const PCLPointField& field : cloud.fields) {
    const auto add = [&](const std::string& name, std::size_t offset, std::uint8_t type) {
      view.fields.push_back({name, cloud.data.data() + field.offset + offset, cloud.point_step, type});
    };
    if (field.name == "_")
      continue; // padding between fields
    const std::size_t end = field.offset + std::max<std::size_t>(field.count, 1) * getFieldSize(field.datatype);
    if (end > cloud.point_step)
      throw FileError("cannot be written: the field '" + field.name + "' of the mesh's cloud ends at byte " +
                      std::to_string(end) + " of points of " + std::to_string(cloud.point_step) + " bytes");
    if (field.name == "rgb" || field.name == "rgba") {
      add("red", 2, PCLPointField::UINT8);
      add("green", 1, PCLPointField::UINT8);
      add("blue", 0, PCLPointField::UINT8);
    } else if (field.name.size() == 8 && field.name.compare(0, 7, "normal_") == 0)
      add(std::string("n") + field.name[7], 0, field.datatype);
    else if (field.count <= 1)
      add(field.name, 0, field.datatype);
    else
      for (std::uint32_t n = 0; n < field.count; ++n)
        add(field.name + "_" + std::to_string(n), n * static_cast<std::size_t>(getFieldSize(field.datatype)),
            field.datatype);
  }
  view.polygons = mesh.polygons.size();
  view.corners = [&mesh](std::size_t polygon, std::vector<std::int32_t>& corners) {
    const pcl::Indices& vertices = mesh.polygons[polygon].vertices;
    corners.assign(vertices.begin(), vertices.end());
  };
  return view;
}

/// \param caller name of the function, for error messages
int save(const char* caller, const std::string& path, const pcl::PolygonMesh& mesh,
         void (*write)(const MeshView&, const std::string&))
{
  try {
    std::error_code error;
    const fs::path target = fs::weakly_canonical(path, error); // the link's target, as renaming would replace the link
    if (error)
      throw FileError("cannot be written: " + error.message());
    const auto writeTo = [&](const std::string& file) { write(viewOf(mesh), file); };
    if (fs::exists(target) && !fs::is_regular_file(target))
      writeTo(path);
    else
      writeWhole(target, writeTo);
    return 0;
  } catch (const std::exception& error) {
    PCL_ERROR("[pcl::mrf::%s] '%s' %s\n", caller, path.c_str(), error.what());
    return -1;
  }
}

} // namespace

void writePLY(const MeshView& mesh, const std::string& path)
{
  requirePosition(mesh);
  ByteWriter file(path, ByteOrder::little);
  file.text("ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.vertices) + "\n");
  std::vector<const VertexField*> fields;
  for (const VertexField& field : mesh.fields) {
    file.text(std::string("property ") + typeOf(field, mesh.inSinglePrecision).ply + " " + field.name + "\n");
    fields.push_back(&field);
  }
  file.text("element face " + std::to_string(mesh.polygons) + "\nproperty list uchar int vertex_indices\nend_header\n");
  writeValues(mesh, fields, file);
  forPolygons(mesh, [&](const std::vector<std::int32_t>& corners) {
    constexpr std::size_t maxCorners = 255; // the count is a byte
    if (corners.size() > maxCorners)
      throw FileError("cannot be written: a polygon has " + std::to_string(corners.size()) + " vertices");
    file.value(static_cast<std::uint8_t>(corners.size()));
    for (const std::int32_t vertex : corners)
      file.value(vertex);
  });
  file.close();
}

void writeVTK(const MeshView& mesh, const std::string& path)
{
  const Triple position = requirePosition(mesh);
  ByteWriter file(path, ByteOrder::big);
  file.text("# vtk DataFile Version 3.0\nMarkov random field surface reconstruction\nBINARY\nDATASET POLYDATA\n");
  file.text("POINTS " + std::to_string(mesh.vertices) + " " + typeOf(*position[0], mesh.inSinglePrecision).vtk + "\n");
  writeValues(mesh, position, file);
  std::size_t numbers = 0;
  forPolygons(mesh, [&](const std::vector<std::int32_t>& corners) { numbers += 1 + corners.size(); });
  file.text("\nPOLYGONS " + std::to_string(mesh.polygons) + " " + std::to_string(numbers) + "\n");
  forPolygons(mesh, [&](const std::vector<std::int32_t>& corners) {
    file.value(static_cast<std::int32_t>(corners.size()));
    for (const std::int32_t vertex : corners)
      file.value(vertex);
  });
  file.text("\n");
  writePointData(mesh, position, file);
  file.close();
}

int savePLY(const std::string& path, const pcl::PolygonMesh& mesh)
{
  return save("savePLY", path, mesh, &writePLY);
}

int saveVTK(const std::string& path, const pcl::PolygonMesh& mesh)
{
  return save("saveVTK", path, mesh, &writeVTK);
}

} // namespace pcl::mrf
