// SPDX-License-Identifier: BSD-3-Clause
// PCD. Not through PCL, whose reader takes the memory that a header asks for, whatever the file holds, crashes on some
// malformed ones, and rounds the numbers of text files to float.
#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

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
  std::size_t size = 0;  ///< bytes of one number
  char type = 'F';       ///< I, U or F
  std::size_t count = 1; ///< numbers per point

  std::size_t bytes() const { return size * count; }
  bool isColor() const { return name == "rgb" || name == "rgba"; }
  bool isPadding() const { return name == "_"; }
};

enum class Encoding { ascii, binary, compressed };

struct Header {
  std::vector<Field> fields;
  std::size_t points = 0;
  std::optional<Eigen::Vector3d> sensorOrigin;
  Encoding encoding = Encoding::ascii;
  std::size_t lines = 0; ///< up to and including DATA
  std::string_view body;
};

/// The lines of a header by their first words.
class HeaderLines {
public:
  HeaderLines(const std::string& path, std::string_view text) : path_(path)
  {
    const std::set<std::string_view> keys = {"VERSION", "FIELDS",    "SIZE",   "TYPE", "COUNT",
                                             "WIDTH",   "VIEWPOINT", "HEIGHT", "DATA", "POINTS"};
    std::string_view line;
    std::vector<std::string_view> words;
    for (Lines lines(text); !has("DATA") && lines.next(line); count_ = lines.number()) {
      split(line, words);
      if (words.empty() || words[0][0] == '#')
        continue;
      const std::string_view key = words[0] == "COLUMNS" ? "FIELDS" : words[0]; // an older name of the same
      if (keys.count(key) == 0 && entries_.empty())
        throw FileError(path, "is not a PCD file");
      if (keys.count(key) == 0)
        failAt(lines.number(), "is not a line of a PCD header");
      if (has(key))
        failAt(lines.number(), "the header has a second line " + std::string(key));
      entries_[key] = {lines.number(), {words.begin() + 1, words.end()}};
      body_ = text.substr(static_cast<std::size_t>(line.data() + line.size() - text.data()));
    }
    // The rest of the line is its end: LF or CRLF.
    body_.remove_prefix(std::min(body_.size(), body_.find('\n') + 1));
    for (const char* key : {"FIELDS", "SIZE", "TYPE", "DATA"})
      if (!has(key))
        throw FileError(path, std::string("is not a PCD file: its header has no line ") + key);
  }

  bool has(std::string_view key) const { return entries_.count(key) != 0; }
  std::string_view body() const { return body_; }
  std::size_t count() const { return count_; }

  /// The words behind a key that is there.
  const std::vector<std::string_view>& words(std::string_view key) const { return entries_.at(key).second; }

  /// The same, exactly so many.
  const std::vector<std::string_view>& words(std::string_view key, std::size_t count) const
  {
    if (words(key).size() != count)
      fail(key);
    return words(key);
  }

  /// The same as whole numbers in a range.
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
    failAt(entries_.at(key).first, "is not a line of a PCD header");
  }

private:
  [[noreturn]] void failAt(std::size_t line, const std::string& cause) const
  {
    throw FileError(path_, "line " + std::to_string(line) + ": " + cause);
  }

  const std::string& path_;
  std::map<std::string_view, std::pair<std::size_t, std::vector<std::string_view>>> entries_; ///< with their lines
  std::size_t count_ = 0;
  std::string_view body_;
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
    Field field{std::string(names[f]), sizes[f], types[f][0], counts[f]};
    const bool isPower = (field.size & (field.size - 1)) == 0;
    const bool isType =
        types[f].size() == 1 && (field.type == 'I' || field.type == 'U' || (field.type == 'F' && field.size >= 4));
    if (!isPower || !isType)
      throw FileError(path, "is a malformed PCD file: there is no type " + std::string(types[f]) + " of " +
                                std::to_string(field.size) + " bytes");
    if (field.isColor() && field.bytes() != 4)
      throw FileError(path, "is a malformed PCD file: " + field.name + " does not take four bytes");
    fields.push_back(std::move(field));
  }
  return fields;
}

/// Where the sensor was: zero is also what no one has set, unless the cloud is an image as the sensor saw it.
std::optional<Eigen::Vector3d> parseViewpoint(const HeaderLines& lines, bool isOrganized)
{
  if (!lines.has("VIEWPOINT"))
    return {};
  std::vector<double> values;
  if (!toNumbers(lines.words("VIEWPOINT", 7), values)) // with a rotation, as a quaternion
    lines.fail("VIEWPOINT");
  const Eigen::Vector3d position(values[0], values[1], values[2]);
  if (!position.allFinite() || (position.isZero(0) && !isOrganized))
    return {};
  return position;
}

Header parseHeader(const std::string& path, const std::string& text)
{
  const HeaderLines lines(path, text);
  Header header;
  header.body = lines.body();
  header.lines = lines.count();
  header.fields = parseFields(path, lines, static_cast<std::int64_t>(text.size()));
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
  header.sensorOrigin = parseViewpoint(lines, height > 1);
  // The shortest row of text is a digit and a blank for each number; LZF shrinks to a 88th at most.
  double min = 0;
  for (const Field& field : header.fields)
    min += header.encoding == Encoding::ascii    ? 2. * static_cast<double>(field.count)
           : header.encoding == Encoding::binary ? static_cast<double>(field.bytes())
           : field.isPadding()                   ? 0
                                                 : static_cast<double>(field.bytes()) / 88;
  // The last row of text may have no end.
  const std::size_t there = header.body.size() + (header.encoding == Encoding::ascii ? 1 : 0);
  if (static_cast<double>(header.points) * min > static_cast<double>(there))
    throw FileError(path, "is truncated: too short for the points that it declares");
  if (lines.has("WIDTH") && width * height != header.points)
    throw FileError(path, "is a malformed PCD file: its width and height do not give its number of points");
  return header;
}

template <typename T>
double valueAs(const char* bytes)
{
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

/// One number of a field; the four bytes of a color as a whole number, whatever type the field claims.
double valueAt(const Field& field, const char* bytes)
{
  if (field.isColor())
    return valueAs<std::uint32_t>(bytes);
  if (field.type == 'F')
    return field.size == 4 ? valueAs<float>(bytes) : valueAs<double>(bytes);
  const bool isSigned = field.type == 'I';
  switch (field.size) {
  case 1:
    return isSigned ? valueAs<std::int8_t>(bytes) : valueAs<std::uint8_t>(bytes);
  case 2:
    return isSigned ? valueAs<std::int16_t>(bytes) : valueAs<std::uint16_t>(bytes);
  case 4:
    return isSigned ? valueAs<std::int32_t>(bytes) : valueAs<std::uint32_t>(bytes);
  default:
    return isSigned ? valueAs<std::int64_t>(bytes) : valueAs<std::uint64_t>(bytes);
  }
}

/// Unpacks LZF: a control byte below 32 precedes so many literal bytes plus one; others hold a length and, with the
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
    for (; length > 0; --length) // the copy may overlap what it makes
      unpacked.push_back(unpacked[unpacked.size() - distance]);
  }
  return unpacked.size() == size;
}

/// The points of a file, column by column.
class Body {
public:
  Body(const std::string& path, const std::string& text, const Header& header) : path_(path), header_(header)
  {
    if (header.encoding == Encoding::ascii)
      parseRows(text);
    else if (header.encoding == Encoding::compressed)
      unpack();
  }

  /// The values of the field of this number, which are taken: a second call finds none. Empty if they are vectors.
  std::vector<double> take(std::size_t number)
  {
    const Field& field = header_.fields[number];
    if (header_.encoding == Encoding::ascii)
      return std::move(columns_[number]);
    if (field.count > 1 || field.isPadding())
      return {};
    // Point by point in plain binary files, field by field in compressed ones.
    const bool compressed = header_.encoding == Encoding::compressed;
    std::size_t before = 0, stride = 0;
    for (std::size_t f = 0; f < header_.fields.size(); ++f) {
      const std::size_t bytes = compressed && header_.fields[f].isPadding() ? 0 : header_.fields[f].bytes();
      before += f < number ? bytes : 0;
      stride += bytes;
    }
    const char* bytes =
        (compressed ? unpacked_.data() : header_.body.data()) + before * (compressed ? header_.points : 1);
    std::vector<double> values;
    values.reserve(header_.points);
    for (std::size_t i = 0; i < header_.points; ++i, bytes += compressed ? field.size : stride)
      values.push_back(valueAt(field, bytes));
    return values;
  }

private:
  [[noreturn]] void fail() const { throw FileError(path_, "is a truncated or malformed PCD file"); }

  void unpack()
  {
    std::array<std::uint32_t, 2> sizes{}; // packed, unpacked
    if (header_.body.size() < sizeof(sizes))
      fail();
    std::memcpy(sizes.data(), header_.body.data(), sizeof(sizes));
    std::size_t pointSize = 0;
    for (const Field& field : header_.fields)
      pointSize += field.isPadding() ? 0 : field.bytes();
    const std::string_view packed = header_.body.substr(sizeof(sizes), sizes[0]);
    // The second: so much cannot come out of it.
    if (packed.size() != sizes[0] || sizes[1] > 88 * packed.size() || pointSize == 0 ||
        sizes[1] / pointSize != header_.points || sizes[1] % pointSize != 0 || !unpackLzf(packed, sizes[1], unpacked_))
      fail();
  }

  void parseRows(const std::string& text)
  {
    std::size_t numbers = 0;
    for (const Field& field : header_.fields)
      numbers += field.count;
    columns_.resize(header_.fields.size());
    std::string_view line;
    std::vector<std::string_view> words;
    std::vector<double> values;
    std::size_t rows = 0;
    for (Lines lines(text); rows < header_.points && lines.next(line);) {
      if (lines.number() <= header_.lines || line.find_first_not_of(" \t") == std::string_view::npos)
        continue;
      split(line, words);
      if (!toNumbers(words, values) || values.size() != numbers)
        throw FileError(path_, "line " + std::to_string(lines.number()) + ": is not a row of " +
                                   std::to_string(numbers) + " numbers");
      addRow(values);
      ++rows;
    }
    if (rows < header_.points)
      throw FileError(path_, "is truncated: it declares " + std::to_string(header_.points) + " points and holds " +
                                 std::to_string(rows));
  }

  void addRow(const std::vector<double>& values)
  {
    std::size_t first = 0;
    for (std::size_t f = 0; f < columns_.size(); ++f) {
      const Field& field = header_.fields[f];
      if (field.count == 1 && !field.isPadding())
        columns_[f].push_back(field.isColor() ? packedColor(field, values[first]) : values[first]);
      first += field.count;
    }
  }

  /// Text has the bytes of a color as the number that they are in the field's type.
  static double packedColor(const Field& field, double value)
  {
    if (field.type != 'F')
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

  const std::string& path_;
  const Header& header_;
  std::vector<std::vector<double>> columns_; ///< of a text file
  std::string unpacked_;                     ///< of a compressed file
};

/// Three fields as vectors; empty if one is not there or not a number per point.
std::vector<Eigen::Vector3d> takeVectors(const Header& header, Body& body, const std::array<const char*, 3>& names)
{
  std::array<std::size_t, 3> numbers{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto found = std::find_if(header.fields.begin(), header.fields.end(),
                                    [&](const Field& field) { return field.name == names[axis] && field.count == 1; });
    if (found == header.fields.end())
      return {};
    numbers[axis] = static_cast<std::size_t>(found - header.fields.begin());
  }
  std::vector<Eigen::Vector3d> result(header.points);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double> values = body.take(numbers[axis]);
    for (std::size_t i = 0; i < result.size(); ++i)
      result[i][axis] = values[i];
  }
  return result;
}

/// Blue comes first in the four bytes.
std::vector<std::array<std::uint8_t, 3>> toColors(const std::vector<double>& packed)
{
  std::vector<std::array<std::uint8_t, 3>> colors;
  colors.reserve(packed.size());
  for (const double value : packed) {
    const auto bits = static_cast<std::uint32_t>(value);
    colors.push_back({static_cast<std::uint8_t>(bits >> 16 & 255), static_cast<std::uint8_t>(bits >> 8 & 255),
                      static_cast<std::uint8_t>(bits & 255)});
  }
  return colors;
}

bool isVectorPart(const std::string& name)
{
  return name == "x" || name == "y" || name == "z" || name.rfind("normal_", 0) == 0;
}

} // namespace

PointTable readPcd(const std::string& path, const std::string& text)
{
  const Header header = parseHeader(path, text);
  Body body(path, text, header);
  PointTable table;
  table.sensorOrigin = header.sensorOrigin;
  table.positions = takeVectors(header, body, {"x", "y", "z"});
  if (table.positions.empty())
    throw FileError(path, "has no points with the fields x, y and z");
  for (const Eigen::Vector3d& normal : takeVectors(header, body, {"normal_x", "normal_y", "normal_z"}))
    table.normals.push_back(normal.cast<float>());
  for (std::size_t f = 0; f < header.fields.size(); ++f) {
    const Field& field = header.fields[f];
    if (field.name == "x")
      table.areFloats = header.encoding != Encoding::ascii && field.type == 'F' && field.size == sizeof(float);
    if (isVectorPart(field.name) || field.count > 1 || field.isPadding())
      continue;
    if (field.isColor())
      table.colors = toColors(body.take(f));
    else {
      // Of two fields with one name the first counts.
      std::vector<float>& scalar = table.scalars[field.name];
      if (scalar.empty()) {
        const std::vector<double> values = body.take(f);
        scalar.assign(values.begin(), values.end());
      }
    }
  }
  return table;
}

} // namespace mrf_apps
