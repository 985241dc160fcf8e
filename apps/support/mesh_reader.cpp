// OFF is read here, because neither PCL nor VTK reads it.
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

/// The lines of an OFF file without comments and empty ones, as numbers.
class OffLines {
public:
  OffLines(const std::string& path, std::string_view text) : path_(path), lines_(text) {}

  /// The next line's words. \throw FileError at the end of the file
  const std::vector<std::string_view>& words()
  {
    std::string_view line;
    do {
      if (!lines_.next(line))
        throw FileError(path_, "is truncated");
      split(line.substr(0, line.find('#')), words_);
    } while (words_.empty());
    return words_;
  }

  /// The next line's numbers, at least so many.
  const std::vector<double>& numbers(std::size_t least)
  {
    words();
    numbers_.clear();
    // Behind the indices of a face there may be a colour, by whatever name.
    for (double value = 0; numbers_.size() < words_.size() && toNumber(words_[numbers_.size()], value);)
      numbers_.push_back(value);
    if (numbers_.size() < least)
      throw FileError(path_, "line " + std::to_string(lines_.number()) + ": has fewer than " + std::to_string(least) +
                                 " numbers");
    return numbers_;
  }

private:
  const std::string& path_;
  Lines lines_;
  std::vector<std::string_view> words_;
  std::vector<double> numbers_;
};

} // namespace

SurfaceMesh parseOff(const std::string& path, const std::string& text)
{
  OffLines lines(path, text);
  std::vector<std::string_view> first = lines.words();
  if (first[0] != "OFF" && first[0] != "COFF" && first[0] != "NOFF" && first[0] != "CNOFF")
    throw FileError(path, "is not an OFF file in text");
  std::vector<double> counts;
  if (first.size() == 1)
    counts = lines.numbers(2);
  else {
    double value = 0;
    for (std::size_t i = 1; i < first.size() && toNumber(first[i], value); ++i)
      counts.push_back(value);
  }
  if (counts.size() < 2 || !isCount(counts[0]) || !isCount(counts[1]))
    throw FileError(path, "is not an OFF file: its numbers of vertices and faces are missing");

  SurfaceMesh mesh;
  for (double v = 0; v < counts[0]; ++v) {
    const std::vector<double>& values = lines.numbers(3);
    mesh.vertices.emplace_back(values[0], values[1], values[2]);
  }
  Polygons faces;
  for (double f = 0; f < counts[1]; ++f) {
    const std::vector<double>& values = lines.numbers(1);
    if (!isCount(values[0]) || static_cast<double>(values.size()) < values[0] + 1)
      throw FileError(path, "is truncated or malformed: a face has fewer corners than it says");
    for (std::size_t i = 1; static_cast<double>(i) <= values[0]; ++i)
      faces.corners.push_back(isCount(values[i]) ? static_cast<std::int64_t>(values[i]) : -1);
    faces.close();
  }
  addPolygons(path, faces, mesh);
  return mesh;
}

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
  if (type == "ply" || type == "obj") {
    PointTable table = type == "ply" ? readPly(path, text, &faces) : parseObj(path, text, &faces);
    mesh = withFaces(path, std::move(table), faces);
  } else
    mesh = type == "off"   ? parseOff(path, text)
           : type == "vtk" ? parseVtk(path, text)
           : type == "vtp" ? parseVtp(path, text)
                           : parseStl(path, text);
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
