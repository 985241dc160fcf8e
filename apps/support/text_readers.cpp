// SPDX-License-Identifier: BSD-3-Clause
// XYZ, which has no other reader, and OBJ: PCL's reader pairs vertices and normals by their order in the file.
#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace mrf_apps {
namespace {

[[noreturn]] void failAt(const std::string& path, std::size_t line, const std::string& cause)
{
  throw FileError(path, "line " + std::to_string(line) + ": " + cause);
}

Eigen::Vector3d vectorAt(const std::vector<double>& values, std::size_t first)
{
  return {values[first], values[first + 1], values[first + 2]};
}

bool isComment(std::string_view line)
{
  const std::size_t begin = line.find_first_not_of(" \t");
  return begin == std::string_view::npos || line[begin] == '#' || line.substr(begin, 2) == "//";
}

/// A line that names the columns: words of letters, the first three x, y, z.
bool isColumnNames(const std::vector<std::string_view>& words)
{
  const auto is = [](std::string_view word, char letter) {
    return word.size() == 1 && (word[0] == letter || word[0] == letter - 'a' + 'A');
  };
  return words.size() >= 3 && is(words[0], 'x') && is(words[1], 'y') && is(words[2], 'z');
}

/// Rows of numbers, all of one length.
struct Rows {
  std::size_t columns = 0;
  std::vector<double> values;

  std::size_t size() const { return columns == 0 ? 0 : values.size() / columns; }
  Eigen::Vector3d vectorAt(std::size_t row, std::size_t column) const
  {
    return Eigen::Map<const Eigen::Vector3d>(values.data() + row * columns + column);
  }
};

Rows parseRows(const std::string& path, std::string_view text)
{
  if (text.substr(0, 3) == "\xef\xbb\xbf")
    text.remove_prefix(3);
  Rows rows;
  double announced = -1;
  std::string_view line;
  std::vector<std::string_view> words;
  std::vector<double> values;
  bool named = false;
  for (Lines lines(text); lines.next(line);) {
    if (isComment(line))
      continue;
    splitRow(line, words);
    if (!toNumbers(words, values)) {
      if (rows.columns == 0 && !named && isColumnNames(words)) {
        named = true;
        continue;
      }
      failAt(path, lines.number(), "is not a row of numbers");
    }
    if (haveDecimalCommas(words)) // they would make two numbers of one
      failAt(path, lines.number(),
             "has commas within numbers, it seems; write 0.5 for 0,5, or part all columns by commas");
    if (rows.columns == 0 && values.size() == 1 && announced < 0 && isCount(values[0])) {
      announced = values[0];
      continue;
    }
    if (values.size() < 3)
      failAt(path, lines.number(), "has fewer than the three columns x y z");
    if (rows.columns == 0)
      rows.columns = values.size();
    if (values.size() != rows.columns)
      failAt(path, lines.number(),
             "has " + std::to_string(values.size()) + " columns, those before have " + std::to_string(rows.columns));
    rows.values.insert(rows.values.end(), values.begin(), values.end());
  }
  if (announced > static_cast<double>(rows.size()))
    throw FileError(path, "is truncated: it announces " + std::to_string(static_cast<long long>(announced)) +
                              " points and holds " + std::to_string(rows.size()));
  return rows;
}

/// What columns 4 to 6 are can only be told from their values.
void addVectorColumns(const Rows& rows, PointTable& table)
{
  std::size_t units = 0, bytes = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::Vector3d v = rows.vectorAt(i, 3);
    const double length = v.norm();
    units += std::abs(length - 1) < .1 || !(length > 0);
    bytes += v.array().round().matrix() == v && v.minCoeff() >= 0 && v.maxCoeff() <= 255;
  }
  const bool areNormals = 10 * units >= 9 * rows.size();
  const bool areColors = bytes == rows.size();
  if (areColors && !areNormals) {
    table.notes.emplace_back("columns 4 to 6 are whole numbers up to 255: taken for colors");
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Eigen::Vector3d v = rows.vectorAt(i, 3);
      table.colors.push_back({toByte(v.x()), toByte(v.y()), toByte(v.z())});
    }
  } else if (areNormals)
    for (std::size_t i = 0; i < rows.size(); ++i)
      table.normals.push_back(rows.vectorAt(i, 3).cast<float>());
  else
    table.notes.emplace_back("columns 4 to 6 are neither unit normals nor colors: ignored");
}

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
    failAt(path, line, "a vertex needs three coordinates");
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
        failAt(path, lines.number(), "is not a row of numbers");
      if (isVertex)
        addObjVertex(path, lines.number(), values, data);
      else if (values.size() == 3)
        data.normals.push_back(vectorAt(values, 0));
      else
        failAt(path, lines.number(), "a normal needs three coordinates");
    } else if (line[0] == 'f' && (line[1] == ' ' || line[1] == '\t')) {
      split(line.substr(2), words);
      for (const std::string_view word : words) {
        Face corner;
        if (!parseCorner(word, static_cast<std::int64_t>(data.positions.size()),
                         static_cast<std::int64_t>(data.normals.size()), corner))
          failAt(path, lines.number(), "is not a face");
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

PointTable parseXyz(const std::string& path, const std::string& text)
{
  const Rows rows = parseRows(path, text);
  PointTable table;
  for (std::size_t i = 0; i < rows.size(); ++i)
    table.positions.push_back(rows.vectorAt(i, 0));
  if (rows.columns >= 6)
    addVectorColumns(rows, table);
  for (std::size_t column = rows.columns >= 6 ? 6 : 3; column < rows.columns; ++column) {
    const std::string name = rows.columns == 4 ? "intensity" : "column" + std::to_string(column + 1);
    std::vector<float>& values = table.scalars[name];
    for (std::size_t i = 0; i < rows.size(); ++i)
      values.push_back(static_cast<float>(rows.values[i * rows.columns + column]));
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
