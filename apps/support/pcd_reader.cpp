// SPDX-License-Identifier: BSD-3-Clause
// Reads PCD. PCL's reader is not used: it allocates what the header asks for, whatever the file holds, crashes on some
// malformed files, and rounds the numbers of text files to float.
#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <pcl/surface/mrf/point_set.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <set>

namespace mrf_apps {
namespace {

/// One field as the header declares it.
struct Field {
  std::string name;
  const NumberType* type; ///< of a color always U4: its four bytes as a whole number
  bool isFloat;           ///< by the header, for colors too
  std::size_t count;      ///< numbers per point

  std::size_t bytes() const { return type->size * count; }
  bool isColor() const { return count == 1 && (name == "rgb" || name == "rgba"); }
  bool isPadding() const { return name == "_"; }
  bool isNumber() const { return count == 1 && !isPadding() && !isColor(); }
};

enum class Encoding { ascii, binary, compressed };

struct Header {
  std::vector<Field> fields;
  std::optional<std::size_t> color; ///< number of the color field, the last one if there are several
  std::size_t points = 0;
  std::optional<Eigen::Vector3d> sensorOrigin;
  std::size_t width = 0, height = 0;
  Encoding encoding = Encoding::ascii;
  Lines lines; ///< of the body
};

/// The lines of a header by their first words.
class HeaderLines {
public:
  HeaderLines(const std::string& path, std::string_view text) : path_(path), lines_(text, path)
  {
    const std::set<std::string_view> keys = {"VERSION", "FIELDS",    "SIZE",   "TYPE", "COUNT",
                                             "WIDTH",   "VIEWPOINT", "HEIGHT", "DATA", "POINTS"};
    std::vector<std::string_view> words;
    while (!has("DATA") && lines_.next(words)) {
      if (words[0][0] == '#')
        continue;
      const std::string_view key = words[0] == "COLUMNS" ? "FIELDS" : words[0]; // an older name of FIELDS
      if (keys.count(key) == 0 && entries_.empty())
        throw FileError(path, "is not a PCD file");
      if (keys.count(key) == 0)
        lines_.fail("is not a line of a PCD header");
      if (has(key))
        lines_.fail("the header has a second line " + std::string(key));
      entries_[key] = {lines_.number(), {words.begin() + 1, words.end()}};
    }
    for (const char* key : {"FIELDS", "SIZE", "TYPE", "DATA"})
      if (!has(key))
        throw FileError(path, std::string("is not a PCD file: its header has no line ") + key);
  }

  bool has(std::string_view key) const { return entries_.count(key) != 0; }
  const Lines& behind() const { return lines_; }

  /// The words behind a key. \pre has(key)
  const std::vector<std::string_view>& words(std::string_view key) const { return entries_.at(key).second; }

  /// The same; fails unless there are `count` words.
  const std::vector<std::string_view>& words(std::string_view key, std::size_t count) const
  {
    if (words(key).size() != count)
      fail(key);
    return words(key);
  }

  /// The same as whole numbers; fails unless they are in the range.
  std::vector<std::size_t> counts(std::string_view key, std::size_t count, std::int64_t min, std::int64_t max) const
  {
    std::vector<std::size_t> result;
    for (const std::string_view word : words(key, count)) {
      std::int64_t value = 0;
      if (!toCount(word, value) || value < min || value > max)
        fail(key);
      result.push_back(static_cast<std::size_t>(value));
    }
    return result;
  }

  [[noreturn]] void fail(std::string_view key) const
  {
    throw FileError(path_, entries_.at(key).first, "is not a line of a PCD header");
  }

private:
  const std::string& path_;
  Lines lines_;
  std::map<std::string_view, std::pair<std::size_t, std::vector<std::string_view>>> entries_; ///< line and words
};

std::vector<Field> parseFields(const std::string& path, const HeaderLines& lines, std::int64_t fileSize)
{
  const std::vector<std::string_view>& names = lines.words("FIELDS");
  const std::size_t count = names.size();
  const std::vector<std::string_view>& types = lines.words("TYPE", count);
  const std::vector<std::size_t> sizes = lines.counts("SIZE", count, 1, 8);
  const std::vector<std::size_t> counts =
      lines.has("COUNT") ? lines.counts("COUNT", count, 1, fileSize) : std::vector<std::size_t>(count, 1);
  std::vector<Field> fields;
  for (std::size_t f = 0; f < count; ++f) {
    const NumberType* type = types[f].size() == 1 ? numberType(types[f][0], sizes[f]) : nullptr;
    if (type == nullptr)
      throw FileError(path, "is a malformed PCD file: there is no type " + std::string(types[f]) + " of " +
                                std::to_string(sizes[f]) + " bytes");
    Field field{std::string(names[f]), type, type->kind == 'F', counts[f]};
    if ((field.name == "rgb" || field.name == "rgba") && field.bytes() != 4)
      throw FileError(path, "is a malformed PCD file: " + field.name + " does not take four bytes");
    if (field.isColor())
      field.type = numberType('U', 4);
    fields.push_back(std::move(field));
  }
  return fields;
}

/// The position of the sensor, if it is finite.
std::optional<Eigen::Vector3d> parseViewpoint(const HeaderLines& lines)
{
  if (!lines.has("VIEWPOINT"))
    return {};
  std::vector<double> values;
  if (!toNumbers(lines.words("VIEWPOINT", 7), values)) // a position and a quaternion
    lines.fail("VIEWPOINT");
  const Eigen::Vector3d position(values[0], values[1], values[2]);
  return position.allFinite() ? std::optional(position) : std::nullopt;
}

Header parseHeader(const std::string& path, const std::string& text)
{
  const HeaderLines lines(path, text);
  Header header;
  header.lines = lines.behind();
  header.fields = parseFields(path, lines, static_cast<std::int64_t>(text.size()));
  for (std::size_t f = 0; f < header.fields.size(); ++f)
    if (header.fields[f].isColor())
      header.color = f;
  const std::string_view encoding = lines.words("DATA", 1)[0];
  if (encoding == "binary")
    header.encoding = Encoding::binary;
  else if (encoding == "binary_compressed")
    header.encoding = Encoding::compressed;
  else if (encoding != "ascii")
    lines.fail("DATA");

  constexpr std::int64_t max = std::numeric_limits<std::uint32_t>::max();
  if (!lines.has("POINTS") && !lines.has("WIDTH"))
    throw FileError(path, "is not a PCD file: its header has no line POINTS");
  const std::size_t width = lines.has("WIDTH") ? lines.counts("WIDTH", 1, 0, max)[0] : 0;
  const std::size_t height = lines.has("HEIGHT") ? lines.counts("HEIGHT", 1, 0, max)[0] : 1;
  header.points = lines.has("POINTS") ? lines.counts("POINTS", 1, 0, max)[0] : width * height;
  if (header.points == 0)
    throw FileError(path, "holds no points");
  header.sensorOrigin = parseViewpoint(lines);
  header.width = width;
  header.height = height;
  // The minimum bytes of a point: in text a digit and a blank for each number; LZF packs 88 bytes into one at most.
  double min = 0;
  for (const Field& field : header.fields)
    min += header.encoding == Encoding::ascii    ? 2. * static_cast<double>(field.count)
           : header.encoding == Encoding::binary ? static_cast<double>(field.bytes())
           : field.isPadding()                   ? 0
                                                 : static_cast<double>(field.bytes()) / 88;
  // The last row of text may have no line end.
  const std::size_t there = header.lines.rest().size() + (header.encoding == Encoding::ascii ? 1 : 0);
  if (static_cast<double>(header.points) * min > static_cast<double>(there))
    throw FileError(path, "is truncated: too short for the points that it declares");
  if (lines.has("WIDTH") && width * height != header.points)
    throw FileError(path, "is a malformed PCD file: its width and height do not give its number of points");
  return header;
}

/// Unpacks LZF. After a control byte c < 32 come c + 1 literal bytes; other control bytes hold a length and, with the
/// next byte, how far back to copy from. \return false if the data are not exactly `size` bytes
bool unpackLzf(std::string_view packed, std::size_t size, std::string& unpacked)
{
  unpacked.reserve(size);
  for (std::size_t at = 0; at < packed.size();) {
    const auto next = [&] { return at < packed.size() ? static_cast<std::uint8_t>(packed[at++]) : std::uint8_t{0}; };
    const std::size_t control = next();
    if (control < 32) {
      const std::string_view literals = packed.substr(at, control + 1);
      if (literals.size() != control + 1 || literals.size() > size - unpacked.size())
        return false;
      unpacked.append(literals);
      at += literals.size();
      continue;
    }
    std::size_t length = control >> 5;
    if (length == 7)
      length += next();
    length += 2;
    const std::size_t distance = ((control & 31) << 8) + next() + 1;
    if (distance > unpacked.size() || length > size - unpacked.size())
      return false;
    for (; length > 0; --length) // source and target may overlap
      unpacked.push_back(unpacked[unpacked.size() - distance]);
  }
  return unpacked.size() == size;
}

/// The points of a compressed file, field by field, without padding.
std::string unpack(const std::string& path, const Header& header)
{
  const std::string_view body = header.lines.rest();
  std::array<std::uint32_t, 2> sizes{}; // packed, unpacked
  std::memcpy(sizes.data(), body.data(), std::min(sizeof(sizes), body.size()));
  std::size_t pointSize = 0;
  for (const Field& field : header.fields)
    pointSize += field.isPadding() ? 0 : field.bytes();
  const std::string_view packed = body.substr(std::min(sizeof(sizes), body.size()), sizes[0]);
  std::string unpacked;
  // LZF unpacks to less than 88 times its size.
  if (packed.size() != sizes[0] || sizes[1] > 88 * packed.size() || pointSize == 0 ||
      sizes[1] / pointSize != header.points || sizes[1] % pointSize != 0 || !unpackLzf(packed, sizes[1], unpacked))
    throw FileError(path, "is a truncated or malformed PCD file");
  return unpacked;
}

/// Blue is the lowest byte.
std::array<std::uint8_t, 3> toColor(double packed)
{
  const auto bits = static_cast<std::uint32_t>(packed);
  return {static_cast<std::uint8_t>(bits >> 16 & 255), static_cast<std::uint8_t>(bits >> 8 & 255),
          static_cast<std::uint8_t>(bits & 255)};
}

/// The four bytes of a color of a text file, which holds them as a number of the field's type.
double packedColor(const Field& field, double value)
{
  if (!field.isFloat)
    return value >= -2147483648. && value <= 4294967295.
               ? static_cast<double>(static_cast<std::uint32_t>(static_cast<std::int64_t>(value)))
               : 0;
  if (std::isnan(value))
    return 0;
  std::uint32_t bits = 0;
  const auto number = static_cast<float>(value);
  std::memcpy(&bits, &number, sizeof(bits));
  return bits;
}

/// Adds rows to a table. \param at returns the number of a row in a field
template <typename At>
void addRows(const Header& header, std::size_t rows, const At& at, TableFiller& filler, PointTable& table)
{
  filler.add(rows, at);
  if (header.color)
    for (std::size_t row = 0; row < rows; ++row)
      table.colors.push_back(toColor(at(row, *header.color)));
}

void readText(const std::string& path, const Header& header, TableFiller& filler, PointTable& table)
{
  std::vector<std::size_t> first; // column where each field begins
  std::size_t numbers = 0;
  for (const Field& field : header.fields) {
    first.push_back(numbers);
    numbers += field.count;
  }
  std::vector<std::string_view> words;
  std::vector<double> values;
  std::size_t rows = 0;
  const auto at = [&](std::size_t, std::size_t f) {
    const Field& field = header.fields[f];
    return field.isColor() ? packedColor(field, values[first[f]]) : values[first[f]];
  };
  for (Lines lines = header.lines; rows < header.points && lines.next(words); ++rows) {
    if (!toNumbers(words, values) || values.size() != numbers)
      lines.fail("is not a row of " + std::to_string(numbers) + " numbers");
    addRows(header, 1, at, filler, table);
  }
  if (rows < header.points)
    throw FileError(path, "is truncated: it declares " + std::to_string(header.points) + " points and holds " +
                              std::to_string(rows));
}

/// Plain binary files are stored point by point, compressed ones field by field.
void readBinary(const std::string& path, const Header& header, TableFiller& filler, PointTable& table)
{
  const bool isCompressed = header.encoding == Encoding::compressed;
  const std::string unpacked = isCompressed ? unpack(path, header) : "";
  const char* const bytes = isCompressed ? unpacked.data() : header.lines.rest().data();
  std::vector<std::size_t> first; // byte where each field of the first point begins
  std::size_t pointSize = 0;
  for (const Field& field : header.fields) {
    first.push_back(pointSize * (isCompressed ? header.points : 1));
    pointSize += isCompressed && field.isPadding() ? 0 : field.bytes();
  }
  constexpr std::size_t portion = 512; // stays in the fastest cache
  std::vector<std::vector<double>> columns(first.size(), std::vector<double>(portion));
  for (std::size_t done = 0; done < header.points; done += portion) {
    const std::size_t rows = std::min(portion, header.points - done);
    for (std::size_t f = 0; f < first.size(); ++f) {
      const Field& field = header.fields[f];
      const std::size_t stride = isCompressed ? field.type->size : pointSize;
      if (field.count == 1 && !field.isPadding())
        field.type->decode(bytes + first[f] + done * stride, stride, rows, false, columns[f].data());
    }
    addRows(
        header, rows, [&](std::size_t row, std::size_t f) { return columns[f][row]; }, filler, table);
  }
}

} // namespace

PointTable readPcd(const std::string& path, const std::string& text)
{
  const Header header = parseHeader(path, text);
  std::vector<std::string> names;
  for (const Field& field : header.fields)
    names.push_back(field.isNumber() ? field.name : "");
  PointTable table;
  table.sensorOrigin = header.sensorOrigin;
  TableFiller filler(names, header.points, table);
  if (!filler.vectors().position)
    throw FileError(path, "has no points with the fields x, y and z");
  const NumberType& type = *header.fields[filler.vectors().position->front()].type;
  table.areFloats = header.encoding != Encoding::ascii && type.kind == 'F' && type.size == sizeof(float);
  if (header.encoding == Encoding::ascii)
    readText(path, header, filler, table);
  else
    readBinary(path, header, filler, table);
  filler.finish(false);
  // Zero is the default that nobody set, unless the cloud is an image from there.
  if (table.sensorOrigin && table.sensorOrigin->isZero(0) &&
      (header.height < 2 || !pcl::mrf::isImageFromZero(header.width, header.height, [&](std::size_t i) {
         return Eigen::Vector3f(table.positions[i].cast<float>());
       })))
    table.sensorOrigin.reset();
  return table;
}

} // namespace mrf_apps
