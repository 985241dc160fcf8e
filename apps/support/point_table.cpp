// SPDX-License-Identifier: BSD-3-Clause
#include "point_table.h"

#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace mrf_apps {

const char* const pointFileExtensions = "pcd, ply, obj, off, xyz, txt, asc, csv, pts or ptx";

const std::vector<std::string>& pointFormats()
{
  static const std::vector<std::string> all = {"pcd", "ply", "obj", "off", "xyz", "txt", "asc", "csv", "pts", "ptx"};
  return all;
}

std::string pointFormatOf(std::string_view text)
{
  constexpr std::string_view byteOrderMark = "\xef\xbb\xbf";
  if (text.substr(0, byteOrderMark.size()) == byteOrderMark)
    text.remove_prefix(byteOrderMark.size());
  const auto isOneOf = [](std::string_view word, std::initializer_list<std::string_view> words) {
    return std::find(words.begin(), words.end(), word) != words.end();
  };
  std::string_view line;
  std::vector<std::string_view> words;
  for (Lines lines(text); lines.next(line);) {
    splitRow(line, words);
    if (line.substr(0, 6) == "# .PCD")
      return "pcd";
    if (words.empty() || words[0][0] == '#' || words[0].substr(0, 2) == "//")
      continue;
    double number = 0;
    if (words[0] == "ply" && words.size() == 1)
      return "ply";
    if (isOneOf(words[0], {"OFF", "COFF", "NOFF", "CNOFF"}))
      return "off";
    if (isOneOf(words[0], {"VERSION", "FIELDS"}))
      return "pcd";
    if (isOneOf(words[0], {"v", "vn", "vt", "f", "o", "g", "s", "mtllib", "usemtl"}))
      return "obj";
    if (!toNumber(words[0], number))
      return columnNames(line).empty() ? "" : "xyz";
    // PTX begins with two counts in lines of their own.
    const bool isCounted = words.size() == 1 && lines.next(line);
    splitRow(line, words);
    return isCounted && words.size() == 1 ? "ptx" : "xyz";
  }
  return {};
}

PointTable parsePoints(const std::string& format, const std::string& path, const std::string& text)
{
  PointTable table = format == "obj"   ? parseObj(path, text)
                     : format == "off" ? parseOff(path, text)
                     : format == "pcd" ? readPcd(path, text)
                     : format == "ply" ? readPly(path, text)
                     : format == "ptx" ? parsePtx(path, text)
                                       : parseXyz(path, text);
  if (table.size() == 0)
    throw FileError(path, "holds no points");
  return table;
}

PointTable readPoints(const std::string& path, const std::string& format)
{
  if (path == "-") {
    const std::string text = readStandardInput();
    const std::string type = format.empty() ? pointFormatOf(text) : format;
    if (type.empty())
      throw FileError("standard input",
                      std::string("looks like none of ") + pointFileExtensions + "; say --input-format");
    return parsePoints(type, "standard input", text);
  }
  const std::string type = format.empty() ? extension(path) : format;
  const std::vector<std::string>& known = pointFormats();
  if (std::find(known.begin(), known.end(), type) == known.end())
    throw UsageError("'" + path + "': input files end in " + pointFileExtensions + conversionHint(path));
  return parsePoints(type, path, readWholeFile(path));
}

namespace {

/// The box without the outermost hundredth at either end of each axis, of some thousand points: a few strays far away
/// say nothing about the digits that the others need.
Eigen::AlignedBox3d innerBox(const std::vector<Eigen::Vector3d>& positions)
{
  constexpr std::size_t samples = 5000;
  std::array<std::vector<double>, 3> coordinates;
  const std::size_t step = positions.size() / samples + 1;
  for (std::size_t i = 0; i < positions.size(); i += step)
    if (positions[i].allFinite())
      for (std::size_t axis = 0; axis < 3; ++axis)
        coordinates[axis].push_back(positions[i][axis]);
  Eigen::AlignedBox3d box;
  const std::size_t count = coordinates[0].size();
  if (count == 0)
    return box;
  Eigen::Vector3d lower, upper;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::sort(coordinates[axis].begin(), coordinates[axis].end());
    lower[axis] = coordinates[axis][count / 100];
    upper[axis] = coordinates[axis][count - 1 - count / 100];
  }
  return {lower, upper};
}

} // namespace

Eigen::Vector3d floatOffset(const std::vector<Eigen::Vector3d>& positions)
{
  const Eigen::AlignedBox3d box = innerBox(positions);
  if (box.isEmpty())
    return Eigen::Vector3d::Zero();
  const auto farthest = static_cast<float>(box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff());
  const double step = std::nextafter(farthest, std::numeric_limits<float>::infinity()) - farthest;
  if (step <= 2e-7 * box.diagonal().norm())
    return Eigen::Vector3d::Zero();
  return box.center();
}

} // namespace mrf_apps
