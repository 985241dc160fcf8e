// SPDX-License-Identifier: BSD-3-Clause
#include "point_table.h"

#include "errors.h"
#include "float_offset.h"
#include "point_readers.h"
#include "text_file.h"

#include <base/byte_writer.h>
#include <pcl/surface/mrf/option_table.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace mrf_apps {
namespace {

/// Moves values to the end of others, and frees their memory.
template <typename Value>
void append(std::vector<Value>& more, std::vector<Value>& values)
{
  values.insert(values.end(), more.begin(), more.end());
  more = std::vector<Value>();
}

void appendSensors(PointTable& more, PointTable& table)
{
  if (more.sensorOrigin) {
    more.sensors = {*more.sensorOrigin};
    more.views.assign(more.size(), 0);
  }
  std::vector<std::int32_t> numbers; // of the sensors in the table
  for (const Eigen::Vector3d& sensor : more.sensors) {
    const auto known = std::find(table.sensors.begin(), table.sensors.end(), sensor);
    numbers.push_back(static_cast<std::int32_t>(known - table.sensors.begin()));
    if (known == table.sensors.end())
      table.sensors.push_back(sensor);
  }
  for (const std::int32_t view : more.views)
    table.views.push_back(numbers[view]);
}

/// Warnings about files that are so far from the files before them that they may be in another frame.
std::vector<std::string> farApart(const std::vector<PointTable>& tables, const std::vector<std::string>& paths)
{
  constexpr double wide = 100; // times the larger extent of the two
  std::vector<std::string> warnings;
  Eigen::AlignedBox3d before;
  for (std::size_t n = 0; n < tables.size(); ++n) {
    const Eigen::AlignedBox3d box = boxOf(tables[n].positions);
    const bool areBoth = !before.isEmpty() && !box.isEmpty();
    const double extent = areBoth ? std::max(before.diagonal().norm(), box.diagonal().norm()) : 0;
    if (extent > 0 && before.exteriorDistance(box) > wide * extent)
      warnings.push_back("'" + paths[n] + "' is " + pcl::mrf::decimalText(std::round(before.exteriorDistance(box))) +
                         " away from the files before it, each of which is less than a hundredth of that wide: are "
                         "they in one frame?");
    before.extend(box);
  }
  return warnings;
}

/// The header of a PLY or PCD file with coordinates and, if there are any, normals.
std::string headerOf(const std::string& format, const std::string& count, bool isDouble, bool hasNormals)
{
  const std::string type = isDouble ? "double" : "float", size = isDouble ? "8" : "4";
  std::string ply, names, sizes, types, counts;
  const auto add = [&](const char* name, const char* nameInPcd, const std::string& itsType,
                       const std::string& itsSize) {
    ply += "property " + itsType + " " + name + "\n";
    names += std::string(" ") + nameInPcd;
    sizes += " " + itsSize;
    types += " F";
    counts += " 1";
  };
  for (const char* name : {"x", "y", "z"})
    add(name, name, type, size);
  for (const char* name : {"nx", "ny", "nz"})
    if (hasNormals)
      add(name, (std::string("normal_") + name[1]).c_str(), "float", "4");
  if (format == "ply")
    return "ply\nformat binary_little_endian 1.0\nelement vertex " + count + "\n" + ply + "end_header\n";
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS" + names + "\nSIZE" + sizes + "\nTYPE" +
         types + "\nCOUNT" + counts + "\nWIDTH " + count + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count +
         "\nDATA binary\n";
}

/// Makes the points not finite whose height is the number by which elevation models mark cells without data. All other
/// heights must be far above it.
void leaveOutNoData(PointTable& table)
{
  constexpr double numbers[] = {-9999, -32768, -99999};
  for (const double number : numbers) {
    const auto hasNoData = [&](const Eigen::Vector3d& position) { return position.z() == number; };
    const auto count = std::count_if(table.positions.begin(), table.positions.end(), hasNoData);
    const auto isSound = [&](const Eigen::Vector3d& position) {
      return hasNoData(position) || position.z() > number / 2;
    };
    if (count == 0 || !std::all_of(table.positions.begin(), table.positions.end(), isSound))
      continue;
    for (Eigen::Vector3d& position : table.positions)
      if (hasNoData(position))
        position.setConstant(std::numeric_limits<double>::quiet_NaN());
    table.notes.push_back(std::to_string(count) + " points have the height " + pcl::mrf::decimalText(number) +
                          ", which stands for no data: skipped");
  }
}

PointTable parseAs(const std::string& format, const std::string& path, const std::string& text)
{
  return format == "obj"   ? parseObj(path, text)
         : format == "off" ? parseOff(path, text)
         : format == "pcd" ? readPcd(path, text)
         : format == "ply" ? readPly(path, text)
         : format == "ptx" ? parsePtx(path, text)
         : format == "las" ? parseLas(path, text)
                           : parseXyz(path, text, format);
}

} // namespace

const std::vector<std::string> pointFormats = {"pcd", "ply", "obj", "off", "xyz", "txt", "asc",
                                               "csv", "tsv", "dat", "pts", "ptx", "las"};

const std::string pointFileExtensions = alternatives(pointFormats) + ", also with .gz";

const std::vector<std::string> pointOutputFormats = {"ply", "pcd"};

std::string pointFormatOfName(const std::string& path)
{
  const std::string type = unpackedExtension(path);
  return isOneOf(type, pointFormats) || isOneOf(type, {"xyzn", "xyzrgb"}) ? type : "";
}

std::string pointFormatOf(std::string_view text)
{
  constexpr std::string_view byteOrderMark = "\xef\xbb\xbf";
  if (text.substr(0, byteOrderMark.size()) == byteOrderMark)
    text.remove_prefix(byteOrderMark.size());
  if (text.substr(0, 4) == "LASF")
    return "las";
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
  if (text.compare(0, 2, "\xff\xfe") == 0 || text.compare(0, 2, "\xfe\xff") == 0)
    throw FileError(path, "is text in UTF-16: save it as UTF-8");
  PointTable table;
  try {
    table = parseAs(format, path, text);
  } catch (const FileError&) {
    const std::string other = pointFormatOf(text);
    const bool hasBeginning = isOneOf(format, {"ply", "pcd", "las", "off"});
    if (other.empty() || other == format || (other == "xyz" && !hasBeginning))
      throw;
    throw FileError(path, "is read as " + format + " and begins as " + other + " does: say --input-format " + other);
  }
  if (table.size() == 0)
    throw FileError(path, "holds no points; leave it out if there are other inputs");
  leaveOutNoData(table);
  return table;
}

PointTable readPoints(const std::string& path, const std::string& format)
{
  if (path == "-") {
    const std::string text = readStandardInput();
    const std::string type = format.empty() ? pointFormatOf(text) : format;
    if (type.empty())
      throw FileError("standard input", "looks like none of " + pointFileExtensions + "; say --input-format");
    return parsePoints(type, "standard input", text);
  }
  const std::string type = format.empty() ? pointFormatOfName(path) : format;
  if (type.empty())
    throw UsageError("'" + path + "': input files end in " + pointFileExtensions + conversionHint(path));
  return parsePoints(type, path, readWholeFile(path));
}

PointTable joinPoints(std::vector<PointTable> tables, const std::vector<std::string>& paths)
{
  if (tables.size() == 1)
    return std::move(tables.front());
  PointTable whole;
  whole.warnings = farApart(tables, paths);
  const auto doAllHave = [&](const std::string& what, bool (*has)(const PointTable&), const char* remedy = "") {
    const auto without = std::find_if_not(tables.begin(), tables.end(), has);
    if (without != tables.end() && std::any_of(tables.begin(), tables.end(), has))
      whole.warnings.push_back("'" + paths[without - tables.begin()] + "' has no " + what +
                               ": those of the other files are left out" + remedy);
    return without == tables.end();
  };
  const bool haveNormals = doAllHave("normals", [](const PointTable& table) { return !table.normals.empty(); });
  const bool haveColors = doAllHave("colors", [](const PointTable& table) { return !table.colors.empty(); });
  doAllHave("intensities", [](const PointTable& table) { return table.hasIntensity(); });
  const bool haveSensors = doAllHave(
      "sensor position", [](const PointTable& table) { return table.sensorOrigin || !table.sensors.empty(); },
      "; name all by --sensors and --views");
  whole.scalars = std::move(tables.front().scalars);
  for (std::size_t n = 0; n < tables.size(); ++n) {
    PointTable& more = tables[n];
    for (auto scalar = whole.scalars.begin(); n > 0 && scalar != whole.scalars.end();) {
      const auto same = more.scalars.find(scalar->first);
      if (same != more.scalars.end())
        append(same->second, scalar->second);
      scalar = same == more.scalars.end() ? whole.scalars.erase(scalar) : std::next(scalar);
    }
    if (haveNormals)
      append(more.normals, whole.normals);
    if (haveColors)
      append(more.colors, whole.colors);
    if (haveSensors)
      appendSensors(more, whole);
    append(more.positions, whole.positions);
    for (const std::string& note : more.notes)
      whole.notes.push_back(paths[n] + ": " + note);
    for (const std::string& warning : more.warnings)
      whole.warnings.push_back("'" + paths[n] + "': " + warning);
  }
  return whole;
}

void writePoints(const PointTable& points, const std::string& path, const std::string& format)
{
  const bool hasNormals = !points.normals.empty();
  const bool isDouble = !floatOffset(points.positions).isZero(0);
  pcl::mrf::ByteWriter file(path);
  file.text(headerOf(format, std::to_string(points.size()), isDouble, hasNormals));
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const double coordinate : points.positions[i])
      if (isDouble)
        file.value(coordinate);
      else
        file.value(static_cast<float>(coordinate));
    if (hasNormals)
      for (const float coordinate : points.normals[i])
        file.value(coordinate);
  }
  file.close();
}

} // namespace mrf_apps
