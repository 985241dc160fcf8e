// SPDX-License-Identifier: BSD-3-Clause
#include "mesh_reader.h"

#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>

namespace mrf_apps {
namespace {

/// Appends polygons as fans around their first corners. \throw FileError if a corner is no vertex of the mesh
void addPolygons(const std::string& path, const Polygons& polygons, SurfaceMesh& mesh)
{
  const auto count = static_cast<std::int64_t>(
      std::min<std::size_t>(mesh.vertices.size(), std::size_t{std::numeric_limits<std::int32_t>::max()}));
  for (const std::int64_t corner : polygons.corners)
    if (corner < 0 || corner >= count)
      throw FileError(path, "is truncated or malformed: a face refers to a vertex that is not there");
  const auto vertex = [&](std::size_t corner) { return static_cast<std::int32_t>(polygons.corners[corner]); };
  std::size_t first = 0;
  for (const std::size_t end : polygons.ends) {
    for (std::size_t corner = first + 2; corner < end; ++corner)
      mesh.triangles.push_back({vertex(first), vertex(corner - 1), vertex(corner)});
    first = end;
  }
}

bool plyHasFaces(std::string_view text)
{
  std::vector<std::string_view> words;
  for (Lines lines(text); lines.next(words) && words[0] != "end_header";)
    if (words.size() == 3 && words[0] == "element" && (words[1] == "face" || words[1] == "tristrips"))
      return words[2] != "0";
  return false;
}

bool offHasFaces(std::string_view text)
{
  std::vector<std::string_view> words;
  std::size_t before = 2; // OFF and the number of vertices
  for (Lines lines(text); lines.next(words, '#'); before -= words.size())
    if (words.size() > before)
      return words[before] != "0";
  return false;
}

} // namespace

const std::string meshInputExtensions = "ply, obj, off or stl, also with .gz";

std::string whyNotReadable(const std::string& path)
{
  const bool isKnown = isOneOf(unpackedExtension(path), {"ply", "obj", "off", "stl"});
  return isKnown ? "" : "does not end in " + meshInputExtensions + conversionHint(path);
}

Content contentOf(const std::string& path)
{
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    return Content::other;
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), &gzclose); // packed or not
  std::string text(1 << 16, '\0');
  const int size = file ? gzread(file.get(), text.data(), static_cast<unsigned>(text.size())) : 0;
  text.resize(static_cast<std::size_t>(std::max(size, 0)));
  const std::string format = pointFormatOf(text);
  bool hasFaces = (format == "ply" && plyHasFaces(text)) || (format == "off" && offHasFaces(text));
  if (format == "obj") // a line that is longer than the text is no face's
    for (gzrewind(file.get()); !hasFaces && gzgets(file.get(), text.data(), static_cast<int>(text.size())) != nullptr;)
      hasFaces = text.compare(0, 2, "f ") == 0;
  return format.empty() ? Content::other : hasFaces ? Content::mesh : Content::points;
}

void refuseToReplace(Content content, const std::string& output)
{
  if (contentOf(output) == content)
    throw UsageError("OUTPUT '" + output + "' is there and holds " +
                     (content == Content::mesh ? "a mesh" : "points without faces") +
                     ": if it is an INPUT, name OUTPUT behind it, else delete it");
}

SurfaceMesh mergeVertices(const SurfaceMesh& mesh)
{
  SurfaceMesh result;
  result.doublePrecision = mesh.doublePrecision;
  std::map<std::array<double, 3>, std::int32_t> numbers;
  std::vector<std::int32_t> merged;
  for (const Eigen::Vector3d& x : mesh.vertices) {
    const auto next = static_cast<std::int32_t>(result.vertices.size());
    // Coordinates that are not numbers have no order; such vertices stay alone.
    merged.push_back(x.allFinite() ? numbers.try_emplace({x.x(), x.y(), x.z()}, next).first->second : next);
    if (merged.back() == next)
      result.vertices.push_back(x);
  }
  for (const auto& [a, b, c] : mesh.triangles)
    result.triangles.push_back({merged[a], merged[b], merged[c]});
  return result;
}

SurfaceMesh parseMesh(const std::string& type, const std::string& path, const std::string& text)
{
  Polygons faces;
  PointTable table = type == "ply"   ? readPly(path, text, &faces)
                     : type == "obj" ? parseObj(path, text, &faces)
                     : type == "off" ? parseOff(path, text, &faces)
                                     : parseStl(path, text, faces);
  SurfaceMesh mesh;
  mesh.vertices = std::move(table.positions);
  mesh.scalars = std::move(table.scalars);
  if (table.normals.size() == mesh.vertices.size())
    mesh.normals = std::move(table.normals);
  addPolygons(path, faces, mesh);
  if (mesh.triangles.empty())
    throw FileError(path, "holds no triangles");
  mesh.doublePrecision = std::any_of(mesh.vertices.begin(), mesh.vertices.end(), [](const Eigen::Vector3d& vertex) {
    return vertex.allFinite() && vertex.cast<float>().cast<double>() != vertex;
  });
  return type == "stl" ? mergeVertices(mesh) : mesh;
}

SurfaceMesh readMesh(const std::string& path)
{
  const std::string wrong = whyNotReadable(path);
  if (!wrong.empty())
    throw UsageError("'" + path + "' " + wrong);
  return parseMesh(unpackedExtension(path), path, readWholeFile(path));
}

} // namespace mrf_apps
