// SPDX-License-Identifier: BSD-3-Clause
#include "mesh_reader.h"

#include "errors.h"
#include "mesh_readers.h"
#include "point_table.h"
#include "text_file.h"

#include <algorithm>
#include <limits>

namespace mrf_apps {
namespace {

SurfaceMesh withFaces(const std::string& path, PointTable&& table, const Polygons& faces)
{
  SurfaceMesh mesh;
  mesh.vertices = std::move(table.positions);
  mesh.scalars = std::move(table.scalars);
  addPolygons(path, faces, mesh);
  return mesh;
}

/// A corner of a face as the number of a vertex. \throw FileError if there is none
std::int32_t vertexNumber(const std::string& path, std::int64_t corner, const SurfaceMesh& mesh)
{
  const std::size_t count =
      std::min<std::size_t>(mesh.vertices.size(), std::size_t{std::numeric_limits<std::int32_t>::max()});
  if (corner < 0 || static_cast<std::size_t>(corner) >= count)
    throw FileError(path, "is truncated or malformed: a face refers to a vertex that is not there");
  return static_cast<std::int32_t>(corner);
}

} // namespace

void addPolygons(const std::string& path, const Polygons& polygons, SurfaceMesh& mesh)
{
  std::size_t first = 0;
  for (const std::size_t end : polygons.ends) {
    const auto vertex = [&](std::size_t corner) { return vertexNumber(path, polygons.corners[corner], mesh); };
    for (std::size_t corner = first; corner < end; ++corner)
      vertex(corner);
    for (std::size_t corner = first + 2; corner < end; ++corner)
      mesh.triangles.push_back({vertex(first), vertex(corner - 1), vertex(corner)});
    first = end;
  }
}

void addStrips(const std::string& path, const Polygons& strips, SurfaceMesh& mesh)
{
  std::size_t first = 0;
  for (const std::size_t end : strips.ends) {
    const auto vertex = [&](std::size_t corner) { return vertexNumber(path, strips.corners[corner], mesh); };
    for (std::size_t corner = first; corner < end; ++corner)
      vertex(corner);
    for (std::size_t corner = first + 2; corner < end; ++corner) {
      const bool isTurned = (corner - first) % 2 == 1;
      mesh.triangles.push_back(
          {vertex(corner - 2), vertex(isTurned ? corner : corner - 1), vertex(isTurned ? corner - 1 : corner)});
    }
    first = end;
  }
}

const char* const meshInputExtensions = "ply, obj, off, stl, vtk or vtp";

bool isReadableMesh(const std::string& extension)
{
  const auto known = {"ply", "obj", "off", "stl", "vtk", "vtp"};
  return std::find(known.begin(), known.end(), extension) != known.end();
}

SurfaceMesh mergeVertices(const SurfaceMesh& mesh)
{
  const auto before = [&](std::int32_t a, std::int32_t b) {
    const Eigen::Vector3d& p = mesh.vertices[static_cast<std::size_t>(a)];
    const Eigen::Vector3d& q = mesh.vertices[static_cast<std::size_t>(b)];
    return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
  };
  // Coordinates that are not numbers have no order; such vertices stay alone.
  std::vector<std::int32_t> order, merged(mesh.vertices.size(), -1);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (mesh.vertices[v].allFinite())
      order.push_back(static_cast<std::int32_t>(v));
  std::stable_sort(order.begin(), order.end(), before);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool isNew = i == 0 || before(order[i - 1], order[i]);
    merged[static_cast<std::size_t>(order[i])] = isNew ? order[i] : merged[static_cast<std::size_t>(order[i - 1])];
  }

  SurfaceMesh result;
  result.doublePrecision = mesh.doublePrecision;
  for (std::size_t v = 0; v < merged.size(); ++v) {
    const std::int32_t first = merged[v];
    // The sort keeps the order of equal ones, so that the first of them has been numbered already.
    if (first < 0 || static_cast<std::size_t>(first) == v) {
      merged[v] = static_cast<std::int32_t>(result.vertices.size());
      result.vertices.push_back(mesh.vertices[v]);
    } else
      merged[v] = merged[static_cast<std::size_t>(first)];
  }
  for (const auto& [a, b, c] : mesh.triangles)
    result.triangles.push_back({merged[static_cast<std::size_t>(a)], merged[static_cast<std::size_t>(b)],
                                merged[static_cast<std::size_t>(c)]});
  return result;
}

SurfaceMesh parseMesh(const std::string& type, const std::string& path, const std::string& text)
{
  SurfaceMesh mesh;
  Polygons faces;
  if (type == "ply" || type == "obj" || type == "off") {
    PointTable table = type == "ply"   ? readPly(path, text, &faces)
                       : type == "obj" ? parseObj(path, text, &faces)
                                       : parseOff(path, text, &faces);
    mesh = withFaces(path, std::move(table), faces);
  } else
    mesh = type == "vtk" ? parseVtk(path, text) : type == "vtp" ? parseVtp(path, text) : parseStl(path, text);
  if (mesh.triangles.empty())
    throw FileError(path, "holds no triangles");
  mesh.doublePrecision = std::any_of(mesh.vertices.begin(), mesh.vertices.end(), [](const Eigen::Vector3d& vertex) {
    return vertex.allFinite() && vertex.cast<float>().cast<double>() != vertex;
  });
  return mesh;
}

SurfaceMesh readMesh(const std::string& path)
{
  const std::string type = extension(path);
  if (!isReadableMesh(type))
    throw UsageError("'" + path + "': mesh files end in " + meshInputExtensions);
  return parseMesh(type, path, readWholeFile(path));
}

} // namespace mrf_apps
