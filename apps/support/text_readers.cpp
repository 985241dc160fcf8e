// SPDX-License-Identifier: BSD-3-Clause
// Rows of numbers and PTX, which have no other reader, and OBJ: PCL's reader pairs vertices and normals by their order
// in the file.
#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace mrf_apps {
namespace {

Eigen::Vector3d vectorAt(const std::vector<double>& values, std::size_t first)
{
  return {values[first], values[first + 1], values[first + 2]};
}

bool isComment(std::string_view line)
{
  const std::size_t begin = line.find_first_not_of(" \t");
  return begin == std::string_view::npos || line[begin] == '#' || line.substr(begin, 2) == "//";
}

/// A line of names without units, "X [m]" or "Height(ft)": what is short, in brackets, and has no digit.
std::string withoutUnits(std::string_view line)
{
  constexpr std::size_t longest = 16;
  std::string result;
  while (!line.empty()) {
    const std::size_t begin = std::min(line.find_first_of("[("), line.size());
    result += line.substr(0, begin);
    line.remove_prefix(begin);
    const std::size_t end = line.substr(0, longest).find_first_of("])0123456789");
    const bool isUnit = end != std::string_view::npos && (line[end] == ']' || line[end] == ')');
    result += line.substr(0, isUnit ? 0 : 1);
    line.remove_prefix(isUnit ? end + 1 : std::min<std::size_t>(line.size(), 1));
  }
  return result;
}

/// Rows of numbers, all of one length.
struct Rows {
  std::size_t columns = 0;
  std::vector<double> values;
  std::vector<std::string> names; ///< of the columns; without one they are skipped
  bool areCounted = false;        ///< a line says how many there are

  std::size_t size() const { return columns == 0 ? 0 : values.size() / columns; }
  double at(std::size_t row, std::size_t column) const { return values[row * columns + column]; }
  Eigen::Vector3d vectorAt(std::size_t row, const Triple& parts) const
  {
    return {at(row, parts[0]), at(row, parts[1]), at(row, parts[2])};
  }
};

Rows parseRows(const std::string& path, std::string_view text)
{
  if (text.substr(0, 3) == "\xef\xbb\xbf")
    text.remove_prefix(3);
  Rows rows;
  double announced = 0;
  std::string_view line;
  std::vector<std::string_view> words;
  std::vector<double> values;
  for (Lines lines(text); lines.next(line);) {
    splitRow(line, words);
    if (isComment(line) || !toNumbers(words, values)) {
      std::vector<std::string> names = rows.columns > 0 ? std::vector<std::string>() : columnNames(line);
      if (!names.empty())
        rows.names = std::move(names);
      else if (!isComment(line))
        throw FileError(path, lines.number(),
                        rows.columns > 0 ? "is not a row of numbers"
                                         : "is not a row of numbers, nor names columns x, y and z");
      continue;
    }
    if (haveDecimalCommas(words)) // they would make two numbers of one
      throw FileError(path, lines.number(),
                      "has commas within numbers, it seems; write 0.5 for 0,5, or part all columns by commas");
    // One count is before all rows, or, in PTS, one before those of each scan.
    if ((rows.columns == 0 || rows.areCounted) && values.size() == 1 && isCount(values[0])) {
      announced += values[0];
      rows.areCounted = true;
      continue;
    }
    if (values.size() < 3)
      throw FileError(path, lines.number(), "has fewer than the three columns x y z");
    if (rows.columns == 0)
      rows.columns = values.size();
    if (values.size() != rows.columns)
      throw FileError(path, lines.number(),
                      "has " + std::to_string(values.size()) + " columns, those before have " +
                          std::to_string(rows.columns));
    rows.values.insert(rows.values.end(), values.begin(), values.end());
  }
  if (announced > static_cast<double>(rows.size()))
    throw FileError(path, "is truncated: it announces " + std::to_string(static_cast<long long>(announced)) +
                              " points and holds " + std::to_string(rows.size()));
  return rows;
}

/// Whether the first column numbers the rows, from any number on. Of a few rows it may be a coordinate.
bool areNumbered(const Rows& rows)
{
  constexpr std::size_t min = 10;
  bool result = rows.columns >= 4 && rows.size() >= min && isCount(rows.at(0, 0));
  for (std::size_t i = 1; result && i < rows.size(); ++i)
    result = rows.at(i, 0) == rows.at(0, 0) + static_cast<double>(i);
  return result;
}

enum class Content { unknown, normals, colors };

/// What three columns hold, as their values tell.
Content contentOf(const Rows& rows, std::size_t column)
{
  std::size_t units = 0, bytes = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::Vector3d v = rows.vectorAt(i, {column, column + 1, column + 2});
    const double length = v.norm();
    units += std::abs(length - 1) < .1 || !(length > 0);
    bytes += v.array().round().matrix() == v && v.minCoeff() >= 0 && v.maxCoeff() <= 255;
  }
  return 10 * units >= 9 * rows.size() ? Content::normals : bytes == rows.size() ? Content::colors : Content::unknown;
}

/// Names columns that no header names.
void guessNames(Rows& rows, std::vector<std::string>& notes)
{
  std::vector<std::string>& names = rows.names;
  names = std::vector<std::string>(areNumbered(rows) ? 1 : 0);
  const auto add = [&names](std::initializer_list<const char*> more) {
    names.insert(names.end(), more.begin(), more.end());
  };
  add({"x", "y", "z"});
  const auto left = [&] { return rows.columns - names.size(); };
  const auto next = [&](std::size_t skipped) { return contentOf(rows, names.size() + skipped); };
  // PTS has the intensity before the colors; others have a scalar behind them, which may be a byte as well.
  if (left() == 1 || (left() % 3 == 1 && next(1) == Content::colors &&
                      (next(0) == Content::unknown || (rows.areCounted && next(0) == Content::colors))))
    add({"intensity"});
  bool hasNormals = false, hasColors = false;
  while (left() >= 3) {
    const Content content = next(0);
    const std::string columns =
        "columns " + std::to_string(names.size() + 1) + " to " + std::to_string(names.size() + 3);
    if (content == Content::normals && !hasNormals) {
      hasNormals = true;
      add({"nx", "ny", "nz"});
    } else if (content == Content::colors && !hasColors) {
      hasColors = true;
      add({"red", "green", "blue"});
      notes.push_back(columns + " are whole numbers up to 255: taken for colors");
    } else {
      if (!hasNormals && !hasColors)
        notes.push_back(columns + " are neither unit normals nor colors: kept as scalars");
      break;
    }
  }
  while (left() > 0)
    names.push_back("column" + std::to_string(names.size() + 1));
}

PointTable toTable(Rows rows)
{
  PointTable table;
  if (rows.size() == 0)
    return table;
  if (rows.names.size() + 1 == rows.columns && areNumbered(rows)) // as data frames are written
    rows.names.insert(rows.names.begin(), "");
  if (rows.names.size() != rows.columns) {
    if (!rows.names.empty())
      table.notes.push_back(std::to_string(rows.names.size()) + " columns have names, but the rows have " +
                            std::to_string(rows.columns) + ": the names are ignored");
    guessNames(rows, table.notes);
  }
  if (rows.names.front().empty())
    table.notes.emplace_back("column 1 numbers the points: skipped");
  for (std::string& name : rows.names)
    if (equalsIgnoringCase(name, "intensity"))
      name = "intensity";
  TableFiller filler(rows.names, rows.size(), table);
  filler.add(rows.size(), [&](std::size_t row, std::size_t column) { return rows.at(row, column); });
  filler.finish(false);
  return table;
}

/// The rows of a PTX file, all of which have to be there.
class PtxRows {
public:
  PtxRows(const std::string& path, std::string_view text)
      : path_(path), lines_(text.substr(0, text.find_last_not_of(" \t\r\n") + 1))
  {}

  bool atEnd() const { return lines_.atEnd(); }
  const std::vector<double>& next()
  {
    std::string_view line;
    do {
      if (!lines_.next(line))
        throw FileError(path_, "is truncated: the last scan has fewer lines than its header says");
      split(line, words_);
    } while (words_.empty());
    if (!toNumbers(words_, values_))
      fail("is not a row of numbers");
    return values_;
  }
  [[noreturn]] void fail(const std::string& cause) const { throw FileError(path_, lines_.number(), cause); }

private:
  const std::string& path_;
  Lines lines_;
  std::vector<std::string_view> words_;
  std::vector<double> values_;
};

struct Face {
  std::int64_t vertex = 0, normal = 0; ///< from 0; normal is −1 if there is none
};

/// One corner of a face, "v", "v/t", "v//n" or "v/t/n"; negative indices count from the end.
bool parseCorner(std::string_view word, std::int64_t vertices, std::int64_t normals, Face& corner)
{
  std::array<std::int64_t, 3> indices{};
  for (std::size_t part = 0; part < 3; ++part) {
    const std::size_t slash = word.find('/');
    const std::string_view digits = word.substr(0, slash);
    if (!digits.empty()) {
      const auto result = std::from_chars(digits.data(), digits.data() + digits.size(), indices[part]);
      if (result.ec != std::errc() || result.ptr != digits.data() + digits.size())
        return false;
    }
    if (slash == std::string_view::npos)
      break;
    word.remove_prefix(slash + 1);
  }
  corner.vertex = indices[0] < 0 ? vertices + indices[0] : indices[0] - 1;
  corner.normal = indices[2] < 0 ? normals + indices[2] : indices[2] - 1;
  return corner.vertex >= 0 && corner.normal >= -1;
}

struct ObjData {
  std::vector<Eigen::Vector3d> positions, normals;
  std::vector<Eigen::Vector3f> colors;
  std::vector<Face> corners;
  std::vector<std::size_t> faceEnds; ///< in corners
};

void addObjVertex(const std::string& path, std::size_t line, const std::vector<double>& values, ObjData& data)
{
  if (values.size() < 3)
    throw FileError(path, line, "a vertex needs three coordinates");
  data.positions.push_back(vectorAt(values, 0));
  if (values.size() >= 6)
    data.colors.push_back(vectorAt(values, 3).cast<float>());
}

ObjData parseObjLines(const std::string& path, std::string_view text)
{
  ObjData data;
  std::string_view line;
  std::vector<std::string_view> words;
  std::vector<double> values;
  for (Lines lines(text); lines.next(line);) {
    if (line.size() < 2)
      continue;
    const bool isVertex = line[0] == 'v' && (line[1] == ' ' || line[1] == '\t');
    const bool isNormal = line[0] == 'v' && line[1] == 'n';
    if (isVertex || isNormal) {
      split(line.substr(2), words);
      if (!toNumbers(words, values))
        throw FileError(path, lines.number(), "is not a row of numbers");
      if (isVertex)
        addObjVertex(path, lines.number(), values, data);
      else if (values.size() == 3)
        data.normals.push_back(vectorAt(values, 0));
      else
        throw FileError(path, lines.number(), "a normal needs three coordinates");
    } else if (line[0] == 'f' && (line[1] == ' ' || line[1] == '\t')) {
      split(line.substr(2), words);
      for (const std::string_view word : words) {
        Face corner;
        if (!parseCorner(word, static_cast<std::int64_t>(data.positions.size()),
                         static_cast<std::int64_t>(data.normals.size()), corner))
          throw FileError(path, lines.number(), "is not a face");
        data.corners.push_back(corner);
      }
      data.faceEnds.push_back(data.corners.size());
    }
  }
  for (const Face& corner : data.corners)
    if (static_cast<std::size_t>(corner.vertex) >= data.positions.size() ||
        (corner.normal >= 0 && static_cast<std::size_t>(corner.normal) >= data.normals.size()))
      throw FileError(path, "is truncated or malformed: a face refers to a vertex or normal that is not there");
  return data;
}

void addObjNormals(const ObjData& data, PointTable& table)
{
  if (data.normals.empty())
    return;
  std::vector<Eigen::Vector3f> normals(data.positions.size(), Eigen::Vector3f::Zero());
  bool referred = false;
  for (const Face& corner : data.corners)
    if (corner.normal >= 0) {
      normals[corner.vertex] += data.normals[corner.normal].cast<float>();
      referred = true;
    }
  if (!referred && data.normals.size() != data.positions.size()) {
    table.notes.emplace_back("the normals belong to no vertex: ignored");
    return;
  }
  // A point cloud in an OBJ file has no faces; its normals are in the order of its vertices.
  for (std::size_t i = 0; i < normals.size(); ++i)
    table.normals.push_back(referred ? normals[i].normalized() : data.normals[i].cast<float>());
}

} // namespace

std::vector<std::string> columnNames(std::string_view text)
{
  constexpr std::size_t longest = 1 << 16; // what is longer is no header, and not worth a copy
  const std::string bare = text.size() <= longest ? withoutUnits(text) : "";
  std::string_view line = bare;
  if (isComment(line))
    line.remove_prefix(std::min(line.find_first_not_of("#/ \t"), line.size()));
  line = line.substr(0, line.find_last_not_of(" \t,;") + 1);
  std::vector<std::string> names;
  const auto add = [&names](std::string_view name) {
    name.remove_prefix(std::min(name.find_first_not_of(" \""), name.size()));
    names.emplace_back(name.substr(0, name.find_last_not_of(" \"") + 1));
  };
  // Between commas there may be nothing, or names of several words.
  const std::size_t separator = line.find_first_of(",;\t");
  std::size_t begin = 0, end = separator;
  while (end != std::string_view::npos) {
    end = line.find(line[separator], begin);
    add(line.substr(begin, end - begin));
    begin = end + 1;
  }
  if (!VectorColumns(names).position) {
    names.clear();
    std::vector<std::string_view> words;
    splitRow(line, words);
    std::for_each(words.begin(), words.end(), add);
  }
  return VectorColumns(names).position ? names : std::vector<std::string>();
}

PointTable parseXyz(const std::string& path, const std::string& text)
{
  return toTable(parseRows(path, text));
}

PointTable parsePtx(const std::string& path, const std::string& text)
{
  // Columns, rows, scanner, its three axes, and the transformation of row vectors.
  constexpr std::array<std::size_t, 10> header = {1, 1, 3, 3, 3, 3, 4, 4, 4, 4};
  Rows rows;
  std::vector<Eigen::Vector3d> sensors;
  std::vector<std::int32_t> views;
  bool areKnown = true;
  for (PtxRows lines(path, text); !lines.atEnd();) {
    std::vector<double> numbers;
    for (const std::size_t size : header) {
      const std::vector<double>& values = lines.next();
      if (values.size() != size || !std::all_of(values.begin(), values.end(), [size](double value) {
            return size == 1 ? isCount(value) : std::isfinite(value);
          }))
        lines.fail("is not what the header of a scan has here: " +
                   (size == 1 ? "a count" : std::to_string(size) + " numbers"));
      numbers.insert(numbers.end(), values.begin(), values.end());
    }
    const Eigen::Map<const Eigen::Vector3d> scanner(&numbers[2]);
    const Eigen::Map<const Eigen::Matrix4d> transformation(&numbers[14]); // by columns: of column vectors
    sensors.push_back(scanner.isZero(0) ? Eigen::Vector3d(transformation.col(3).head<3>()) : scanner);
    if (sensors.back().isZero(0) && std::min(numbers[0], numbers[1]) < 2) // as in PCD, nobody has set it
      areKnown = false;
    for (double cell = 0; cell < numbers[0] * numbers[1]; ++cell) {
      const std::vector<double>& values = lines.next();
      if (rows.columns == 0)
        rows.columns = values.size();
      if ((values.size() != 4 && values.size() != 7) || values.size() != rows.columns)
        lines.fail("is not a cell x y z intensity, or all of them x y z intensity r g b");
      const Eigen::Vector3d measured = Eigen::Map<const Eigen::Vector3d>(values.data());
      if (measured.isZero(0))
        continue;
      const Eigen::Vector3d position = (transformation * measured.homogeneous()).head<3>();
      rows.values.insert(rows.values.end(), position.begin(), position.end());
      rows.values.insert(rows.values.end(), values.begin() + 3, values.end());
      views.push_back(static_cast<std::int32_t>(sensors.size() - 1));
    }
  }
  rows.names = {"x", "y", "z", "intensity", "red", "green", "blue"};
  rows.names.resize(rows.columns);
  PointTable table = toTable(std::move(rows));
  if (areKnown && sensors.size() == 1)
    table.sensorOrigin = sensors.front();
  else if (areKnown) {
    table.sensors = std::move(sensors);
    table.views = std::move(views);
  }
  return table;
}

PointTable parseObj(const std::string& path, const std::string& text, Polygons* faces)
{
  const ObjData data = parseObjLines(path, text);
  if (data.positions.empty())
    throw FileError(path, "is not an OBJ file, or has no vertices");
  PointTable table;
  table.positions = data.positions;
  if (data.colors.size() == data.positions.size())
    addColors(data.colors, false, table);
  addObjNormals(data, table);
  if (faces != nullptr) {
    std::size_t corner = 0;
    for (const std::size_t end : data.faceEnds) {
      for (; corner < end; ++corner)
        faces->corners.push_back(data.corners[corner].vertex);
      faces->close();
    }
  }
  return table;
}

} // namespace mrf_apps
