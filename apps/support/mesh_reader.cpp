#include "mesh_reader.h"

#include "errors.h"
#include "point_readers.h"
#include "point_table.h"
#include "text_file.h"

#include <vtkCellArray.h>
#include <vtkCommand.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataReader.h>
#include <vtkSTLReader.h>
#include <vtkXMLPolyDataReader.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace mrf_apps {
namespace {

/// Adds a polygon as a fan around its first corner.
void addPolygon(const std::string& path, const std::vector<std::int64_t>& corners, SurfaceMesh& mesh)
{
  for (const std::int64_t corner : corners)
    if (corner < 0 || corner >= static_cast<std::int64_t>(mesh.vertices.size()))
      throw FileError(path, "is truncated or malformed: a face refers to a vertex that is not there");
  for (std::size_t i = 2; i < corners.size(); ++i)
    mesh.triangles.push_back({static_cast<std::int32_t>(corners[0]), static_cast<std::int32_t>(corners[i - 1]),
                              static_cast<std::int32_t>(corners[i])});
}

SurfaceMesh withFaces(const std::string& path, PointTable&& table, const std::vector<pcl::Vertices>& faces)
{
  SurfaceMesh mesh;
  mesh.vertices = std::move(table.positions);
  for (const pcl::Vertices& face : faces)
    addPolygon(path, {face.vertices.begin(), face.vertices.end()}, mesh);
  return mesh;
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

bool isCount(double value)
{
  return value >= 0 && value <= std::numeric_limits<std::int32_t>::max() && value == std::floor(value);
}

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
  std::vector<std::int64_t> corners;
  for (double f = 0; f < counts[1]; ++f) {
    const std::vector<double>& values = lines.numbers(1);
    if (!isCount(values[0]) || static_cast<double>(values.size()) < values[0] + 1)
      throw FileError(path, "is truncated or malformed: a face has fewer corners than it says");
    corners.clear();
    for (std::size_t i = 1; static_cast<double>(i) <= values[0]; ++i)
      corners.push_back(isCount(values[i]) ? static_cast<std::int64_t>(values[i]) : -1);
    addPolygon(path, corners, mesh);
  }
  return mesh;
}

/// VTK takes what is there of a truncated STL file for the whole.
void checkStl(const std::string& path, const std::string& text)
{
  constexpr std::size_t header = 84, facet = 50;
  std::uint32_t count = 0;
  if (text.size() >= header)
    std::memcpy(&count, text.data() + header - sizeof(count), sizeof(count));
  // Binary files may start with "solid" as well.
  if (text.size() >= header && text.size() == header + facet * count)
    return;
  if (text.compare(0, 5, "solid") != 0)
    throw FileError(path, "is truncated, or not an STL file");
  if (text.find("endsolid") == std::string::npos)
    throw FileError(path, "is truncated: its solid does not end");
}

/// Walks through a legacy VTK file up to its attributes, to see that all numbers are there: VTK's reader crashes on
/// files that end before.
class VtkFileCheck {
public:
  VtkFileCheck(const std::string& path, std::string_view text) : path_(path), rest_(text) {}

  void run()
  {
    const std::string_view magic = "# vtk DataFile Version ";
    std::string_view line = nextLine();
    if (line.substr(0, magic.size()) != magic)
      throw FileError(path_, "is not a legacy VTK file");
    const bool isVersion5 = line.substr(magic.size(), 1) >= "5";
    nextLine(); // the title
    binary_ = nextLine().substr(0, 6) == "BINARY";
    bool hasPoints = false;
    while (!rest_.empty()) {
      line = nextLine();
      split(line, words_);
      if (words_.empty())
        continue;
      const std::string_view keyword = words_[0];
      if (keyword == "POINT_DATA" || keyword == "CELL_DATA" || keyword == "FIELD")
        break;
      if (keyword == "DATASET" && (words_.size() < 2 || words_[1] != "POLYDATA"))
        throw FileError(path_, "holds no polygons: its data set is not POLYDATA");
      if (keyword == "METADATA")
        while (!rest_.empty() && !nextLine().empty()) {
        }
      else if (keyword == "POINTS") {
        hasPoints = true;
        skip(3 * count(1), words_.size() > 2 && words_[2] == "double" ? 8 : 4);
      } else if (keyword == "VERTICES" || keyword == "LINES" || keyword == "POLYGONS" || keyword == "TRIANGLE_STRIPS") {
        const double cells = count(1), size = count(2);
        if (isVersion5) {
          skipIndices(cells);
          skipIndices(size);
        } else
          skipCells(cells, size);
      }
    }
    if (!hasPoints)
      throw FileError(path_, "is truncated, or has no points");
  }

private:
  [[noreturn]] void fail() const { throw FileError(path_, "is a truncated or malformed VTK file"); }

  std::string_view nextLine()
  {
    const std::size_t end = rest_.find('\n');
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    return line.substr(0, line.find('\r'));
  }

  /// A number of the section's first line.
  double count(std::size_t word) const
  {
    double value = 0;
    if (word >= words_.size() || !toNumber(words_[word], value) || !isCount(value))
      fail();
    return value;
  }

  void skip(double numbers, double bytesEach)
  {
    if (binary_) {
      if (numbers * bytesEach > static_cast<double>(rest_.size()))
        fail();
      rest_.remove_prefix(static_cast<std::size_t>(numbers * bytesEach));
    } else
      for (double i = 0; i < numbers; ++i)
        nextNumber();
  }

  /// The arrays of version 5: a line with their name and type, then the numbers.
  void skipIndices(double numbers)
  {
    const std::string_view line = nextLine();
    split(line, words_);
    if (words_.size() < 2 || (words_[0] != "OFFSETS" && words_[0] != "CONNECTIVITY"))
      fail();
    skip(numbers, words_[1] == "vtktypeint64" ? 8 : 4);
    while (!rest_.empty() && (rest_[0] == '\n' || rest_[0] == '\r'))
      rest_.remove_prefix(1);
  }

  /// Cells of the older versions: each a number of corners and as many indices.
  void skipCells(double cells, double size)
  {
    double used = 0;
    for (double cell = 0; cell < cells; ++cell) {
      const double corners = nextIndex();
      if (!isCount(corners) || used + 1 + corners > size)
        fail();
      skip(corners, 4);
      used += 1 + corners;
    }
    if (used != size)
      fail();
  }

  double nextIndex()
  {
    if (!binary_)
      return nextNumber();
    if (rest_.size() < 4)
      fail();
    std::uint32_t value = 0;
    for (int byte = 0; byte < 4; ++byte)
      value = value << 8 | static_cast<std::uint8_t>(rest_[static_cast<std::size_t>(byte)]);
    rest_.remove_prefix(4);
    return static_cast<double>(static_cast<std::int32_t>(value));
  }

  double nextNumber()
  {
    constexpr std::string_view blanks = " \t\r\n";
    const std::size_t begin = rest_.find_first_not_of(blanks);
    if (begin == std::string_view::npos)
      fail();
    rest_.remove_prefix(begin);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(blanks));
    double value = 0;
    if (!toNumber(word, value))
      fail();
    rest_.remove_prefix(word.size());
    return value;
  }

  const std::string& path_;
  std::string_view rest_;
  bool binary_ = false;
  std::vector<std::string_view> words_;
};

/// Notes that VTK reported an error, which it does in several ways.
class ErrorListener {
public:
  void note() { heard_ = true; }
  bool heard() const { return heard_; }

private:
  bool heard_ = false;
};

template <typename Reader>
SurfaceMesh readThroughVtk(const std::string& path, const char* type)
{
  vtkNew<Reader> reader;
  ErrorListener errors;
  reader->AddObserver(vtkCommand::ErrorEvent, &errors, &ErrorListener::note);
  vtkObject::GlobalWarningDisplayOff();
  reader->SetFileName(path.c_str());
  reader->Update();
  vtkObject::GlobalWarningDisplayOn();
  vtkPolyData* data = reader->GetOutput();
  if (errors.heard() || reader->GetErrorCode() != 0 || data == nullptr || data->GetPoints() == nullptr)
    throw FileError(path, std::string("is a truncated or malformed ") + type + " file");

  SurfaceMesh mesh;
  for (vtkIdType v = 0; v < data->GetNumberOfPoints(); ++v)
    mesh.vertices.emplace_back(data->GetPoint(v));
  vtkIdType count = 0;
  const vtkIdType* corners = nullptr;
  vtkCellArray* polygons = data->GetPolys();
  for (polygons->InitTraversal(); polygons->GetNextCell(count, corners) != 0;)
    addPolygon(path, {corners, corners + count}, mesh);
  vtkCellArray* strips = data->GetStrips();
  for (strips->InitTraversal(); strips->GetNextCell(count, corners) != 0;)
    for (vtkIdType i = 2; i < count; ++i)
      addPolygon(path, {corners[i - 2], corners[i % 2 == 0 ? i - 1 : i], corners[i % 2 == 0 ? i : i - 1]}, mesh);
  return mesh;
}

SurfaceMesh readAs(const std::string& type, const std::string& path)
{
  const std::string text = readWholeFile(path);
  std::vector<pcl::Vertices> faces;
  if (type == "ply")
    return withFaces(path, readPly(path, text, &faces), faces);
  if (type == "obj")
    return withFaces(path, parseObj(path, text, &faces), faces);
  if (type == "off")
    return parseOff(path, text);
  if (type == "vtk") {
    VtkFileCheck(path, text).run();
    return readThroughVtk<vtkPolyDataReader>(path, "VTK polydata");
  }
  if (type == "vtp")
    return readThroughVtk<vtkXMLPolyDataReader>(path, "VTP");
  checkStl(path, text);
  return readThroughVtk<vtkSTLReader>(path, "STL");
}

} // namespace

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

SurfaceMesh readMesh(const std::string& path)
{
  const std::string type = extension(path);
  if (!isReadableMesh(type))
    throw UsageError("'" + path + "': mesh files end in " + meshInputExtensions);
  SurfaceMesh mesh = readAs(type, path);
  if (mesh.triangles.empty())
    throw FileError(path, "holds no triangles");
  mesh.doublePrecision = std::any_of(mesh.vertices.begin(), mesh.vertices.end(), [](const Eigen::Vector3d& vertex) {
    return vertex.allFinite() && vertex.cast<float>().cast<double>() != vertex;
  });
  return mesh;
}

} // namespace mrf_apps
