// SPDX-License-Identifier: BSD-3-Clause
// LAS, as the ASPRS specifies its versions 1.0 to 1.4.
#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mrf_apps {
namespace {

/// A point format: the minimum bytes of a point, and the byte where its red channel begins; 0: no color.
struct LasFormat {
  std::size_t size, red;
};
constexpr std::array<LasFormat, 11> lasFormats = {
    {{20, 0}, {28, 0}, {26, 20}, {34, 28}, {57, 0}, {63, 28}, {30, 0}, {36, 30}, {38, 30}, {59, 0}, {67, 30}}};

struct LasHeader {
  std::size_t size = 0, format = 0, begin = 0, stride = 0, points = 0;
  std::array<double, 3> scale{}, offset{};

  bool hasColors() const { return lasFormats[format].red > 0; }
  bool isExtended() const { return format >= 6; } ///< the formats of version 1.4
};

/// A number of the header. \pre the text is long enough
double numberAt(const std::string& text, std::size_t at, char kind, std::size_t size)
{
  double value = 0;
  numberType(kind, size)->decode(text.data() + at, 0, 1, false, &value);
  return value;
}

LasHeader parseLasHeader(const std::string& path, const std::string& text)
{
  if (text.compare(0, 4, "LASF") != 0)
    throw FileError(path, "is not a LAS file");
  constexpr std::size_t usualSize = 227, extendedSize = 375; // bytes, up to version 1.3 and in 1.4
  const auto count = [&](std::size_t at, std::size_t size) { return numberAt(text, at, 'U', size); };
  const auto whole = [&](std::size_t at, std::size_t size) { return static_cast<std::size_t>(count(at, size)); };
  const bool isThere = text.size() >= usualSize;
  const std::size_t major = isThere ? whole(24, 1) : 1, minor = isThere ? whole(25, 1) : 0;
  if (major != 1 || minor > 4)
    throw FileError(path, "is of LAS " + std::to_string(major) + "." + std::to_string(minor) +
                              "; versions 1.0 to 1.4 are read");
  const std::size_t size = minor == 4 ? extendedSize : usualSize;
  if (text.size() < size)
    throw FileError(path, "is truncated: the header of a LAS file has " + std::to_string(size) + " bytes");
  LasHeader header;
  header.format = whole(104, 1);
  if ((header.format & 0xc0) != 0)
    throw FileError(path, "is compressed, as LAZ is" + conversionHint(path, "laz"));
  if (header.format >= lasFormats.size())
    throw FileError(path, "has points of format " + std::to_string(header.format) + "; 0 to 10 are read");
  header.begin = whole(96, 4);
  header.stride = whole(105, 2);
  header.size = whole(94, 2);
  const std::size_t least = lasFormats[header.format].size;
  if (header.size < size || header.begin < header.size)
    throw FileError(path, "is a malformed LAS file: points from byte " + std::to_string(header.begin) +
                              " on, and a header of " + std::to_string(header.size));
  if (header.stride < least)
    throw FileError(path, "is a malformed LAS file: points of format " + std::to_string(header.format) + " take " +
                              std::to_string(least) + " bytes at least, not " + std::to_string(header.stride));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    header.scale[axis] = numberAt(text, 131 + 8 * axis, 'F', 8);
    header.offset[axis] = numberAt(text, 155 + 8 * axis, 'F', 8);
    if (!std::isfinite(header.scale[axis]) || header.scale[axis] == 0 || !std::isfinite(header.offset[axis]))
      throw FileError(path, "is a malformed LAS file: a scale or an offset is no number, or a scale is 0");
  }
  const double old = count(107, 4), points = minor == 4 && old == 0 ? count(247, 8) : old;
  const std::size_t room = header.begin > text.size() ? 0 : (text.size() - header.begin) / header.stride;
  if (points > static_cast<double>(room))
    throw FileError(path, "is truncated: it declares " +
                              std::to_string(static_cast<long long>(std::min(points, 9e18))) + " points and holds " +
                              std::to_string(room));
  header.points = static_cast<std::size_t>(points);
  return header;
}

} // namespace

PointTable parseLas(const std::string& path, const std::string& text)
{
  const LasHeader header = parseLasHeader(path, text);
  struct Column {
    const char* name;
    std::size_t at;
    const NumberType* type;
  };
  const std::size_t red = lasFormats[header.format].red;
  const NumberType* const word = numberType('U', 2);
  std::vector<Column> columns = {{"x", 0, numberType('I', 4)}, {"y", 4, numberType('I', 4)},
                                 {"z", 8, numberType('I', 4)}, {"intensity", 12, word},
                                 {"", 15, numberType('U', 1)},  // formats 6 to 10: flags; others: class and flags
                                 {"", 16, numberType('U', 1)}}; // formats 6 to 10: class
  if (header.hasColors())
    columns.insert(columns.end(), {{"red", red, word}, {"green", red + 2, word}, {"blue", red + 4, word}});
  std::vector<std::string> names;
  for (const Column& column : columns)
    names.emplace_back(column.name);

  PointTable table;
  TableFiller filler(names, header.points, table);
  constexpr unsigned lowNoise = 7, highNoise = 18; // the specification's classes
  constexpr std::size_t portion = 512;             // stays in the fastest cache
  std::vector<std::vector<double>> values(columns.size(), std::vector<double>(portion));
  std::vector<std::size_t> kept; // rows that are neither withheld (LAS's mark of deleted points) nor noise
  std::size_t noisy = 0;
  for (std::size_t done = 0; done < header.points; done += portion) {
    const std::size_t rows = std::min(portion, header.points - done);
    const char* const bytes = text.data() + header.begin + done * header.stride;
    for (std::size_t c = 0; c < columns.size(); ++c)
      columns[c].type->decode(bytes + columns[c].at, header.stride, rows, false, values[c].data());
    kept.clear();
    for (std::size_t row = 0; row < rows; ++row) {
      const auto flags = static_cast<unsigned>(values[4][row]);
      if ((flags & (header.isExtended() ? 4U : 128U)) != 0)
        continue;
      const unsigned type = header.isExtended() ? static_cast<unsigned>(values[5][row]) : flags & 31U;
      if (type == lowNoise || (header.isExtended() && type == highNoise))
        ++noisy;
      else
        kept.push_back(row);
    }
    filler.add(kept.size(), [&](std::size_t row, std::size_t column) {
      const double value = values[column][kept[row]];
      return column < 3 ? header.scale[column] * value + header.offset[column] : value;
    });
  }
  filler.finish(true);
  const std::size_t withheld = header.points - table.size() - noisy;
  if (withheld > 0)
    table.notes.push_back(std::to_string(withheld) + " points are marked as withheld: skipped");
  if (noisy > 0)
    table.notes.push_back(std::to_string(noisy) + " points are classified as noise: skipped");
  // Every point of a format has these fields, even if nobody filled them in.
  const std::vector<float>& intensities = table.scalars["intensity"];
  if (std::all_of(intensities.begin(), intensities.end(), [](float value) { return value == 0; }))
    table.scalars.clear();
  const auto isBlack = [](const std::array<std::uint8_t, 3>& color) { return color == decltype(color){}; };
  if (std::all_of(table.colors.begin(), table.colors.end(), isBlack))
    table.colors.clear();
  return table;
}

} // namespace mrf_apps
