// SPDX-License-Identifier: BSD-3-Clause
// Reads PLY. PCL's reader is not used, because it ends the process on lists of different lengths among the vertex
// properties; VTK's is not, because it drops the properties that it does not know.
#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <algorithm>
#include <cmath>

namespace mrf_apps {
namespace {

const NumberType* typeOf(std::string_view word)
{
  struct Name {
    std::string_view usual, other;
    char kind;
    std::size_t size;
  };
  constexpr Name names[] = {{"char", "int8", 'I', 1},     {"uchar", "uint8", 'U', 1},   {"short", "int16", 'I', 2},
                            {"ushort", "uint16", 'U', 2}, {"int", "int32", 'I', 4},     {"uint", "uint32", 'U', 4},
                            {"float", "float32", 'F', 4}, {"double", "float64", 'F', 8}};
  for (const Name& name : names)
    if (word == name.usual || word == name.other)
      return numberType(name.kind, name.size);
  return nullptr;
}

struct Property {
  std::string name;
  const NumberType* type = nullptr;
  const NumberType* countType = nullptr; ///< of the length of a list; null: no list

  bool isList() const { return countType != nullptr; }
};

struct Element {
  std::string name;
  double count = 0;
  std::vector<Property> properties;

  bool hasLists() const
  {
    return std::any_of(properties.begin(), properties.end(),
                       [](const Property& property) { return property.isList(); });
  }
};

/// Several entries of an element: a column of values for each property; those of lists are not used.
using Columns = std::vector<std::vector<double>>;

enum class Format { unknown, ascii, littleEndian, bigEndian };

struct Header {
  Format format = Format::unknown;
  std::vector<Element> elements;
  std::string_view body;
};

/// \return false if the line is malformed or a type unknown
bool parseProperty(const std::vector<std::string_view>& words, Property& property)
{
  const bool isList = words.size() == 5 && words[1] == "list";
  property.name = words.back();
  property.type = typeOf(words[words.size() - 2]);
  property.countType = isList ? typeOf(words[2]) : nullptr;
  return property.type != nullptr && (isList ? property.isList() : words.size() == 3);
}

Header parseHeader(const std::string& path, const std::string& text)
{
  if (text.compare(0, 4, "ply\n") != 0 && text.compare(0, 4, "ply\r") != 0)
    throw FileError(path, "is not a PLY file");
  Header header;
  std::vector<std::string_view> words;
  Lines lines(text, path);
  while (lines.next(words)) {
    if (words[0] == "ply" || words[0] == "comment" || words[0] == "obj_info")
      continue;
    bool good = false;
    if (words[0] == "end_header") {
      if (header.format == Format::unknown)
        break;
      header.body = lines.rest();
      return header;
    }
    if (words[0] == "format" && words.size() == 3 && header.format == Format::unknown) {
      header.format = words[1] == "ascii"                  ? Format::ascii
                      : words[1] == "binary_little_endian" ? Format::littleEndian
                      : words[1] == "binary_big_endian"    ? Format::bigEndian
                                                           : Format::unknown;
      good = header.format != Format::unknown;
    } else if (words[0] == "element" && words.size() == 3) {
      Element element;
      element.name = words[1];
      const auto isTheSame = [&](const Element& other) { return other.name == element.name; };
      good = toNumber(words[2], element.count) && element.count >= 0 && element.count == std::floor(element.count) &&
             std::none_of(header.elements.begin(), header.elements.end(), isTheSame);
      header.elements.push_back(element);
    } else if (words[0] == "property" && words.size() >= 3 && !header.elements.empty()) {
      Property property;
      good = parseProperty(words, property);
      header.elements.back().properties.push_back(property);
    }
    if (!good)
      lines.fail("is not a line of a PLY header");
  }
  throw FileError(path, "is a truncated or malformed PLY file: its header does not end");
}

/// Reads the numbers of the body in order.
class Body {
public:
  Body(const std::string& path, std::string_view rest, Format format) : path_(path), rest_(rest), format_(format) {}

  std::size_t bytesLeft() const { return rest_.size(); }
  bool isText() const { return format_ == Format::ascii; }
  std::size_t minSize(const NumberType& type) const { return isText() ? 1 : type.size; }

  double next(const NumberType& type)
  {
    if (isText())
      return nextWord();
    double value = 0;
    type.decode(take(type.size), 0, 1, isReversed(), &value);
    return value;
  }

  /// Reads the next `count` entries of an element into the first places of the columns; lists are skipped.
  void next(const Element& element, std::size_t count, Columns& columns)
  {
    if (isText() || element.hasLists()) {
      for (std::size_t row = 0; row < count; ++row)
        for (std::size_t p = 0; p < columns.size(); ++p)
          nextOf(element.properties[p], columns[p][row]);
      return;
    }
    std::size_t stride = 0;
    for (const Property& property : element.properties)
      stride += property.type->size;
    const char* bytes = take(stride * count);
    for (std::size_t p = 0; p < columns.size(); ++p) {
      const NumberType& type = *element.properties[p].type;
      type.decode(bytes, stride, count, isReversed(), columns[p].data());
      bytes += type.size;
    }
  }

  /// Reads the length of a list; fails if the file is too short for it.
  std::size_t nextCount(const Property& list)
  {
    const double count = next(*list.countType);
    if (!isCount(count) || count * static_cast<double>(minSize(*list.type)) > static_cast<double>(rest_.size()))
      fail();
    return static_cast<std::size_t>(count);
  }

  [[noreturn]] void fail() const { throw FileError(path_, "is a truncated or malformed PLY file"); }

private:
  bool isReversed() const { return format_ == Format::bigEndian; }

  void nextOf(const Property& property, double& value)
  {
    if (property.isList())
      for (std::size_t i = nextCount(property); i > 0; --i)
        next(*property.type);
    else
      value = next(*property.type);
  }

  const char* take(std::size_t bytes)
  {
    if (rest_.size() < bytes)
      fail();
    const char* taken = rest_.data();
    rest_.remove_prefix(bytes);
    return taken;
  }

  double nextWord()
  {
    constexpr std::size_t longest = 40; // characters of a word in a message
    const std::string_view word = takeWord(rest_);
    double value = 0;
    if (!toNumber(word, value))
      throw FileError(path_, word.empty()
                                 ? "is truncated: its header declares more numbers than it holds"
                                 : "holds '" + std::string(word.substr(0, longest)) + "' in place of a number");
    return value;
  }

  const std::string& path_;
  std::string_view rest_;
  Format format_;
};

void readVertices(const std::string& path, const Element& element, Body& body, PointTable& table)
{
  std::vector<std::string> names;
  for (const Property& property : element.properties)
    names.push_back(property.isList() ? "" : property.name);
  // The caller checked that the file is long enough.
  const auto count = static_cast<std::size_t>(element.count);
  TableFiller filler(names, count, table);
  const VectorColumns& vectors = filler.vectors();
  if (!vectors.position)
    throw FileError(path, "has no vertices with the properties x, y and z");
  const NumberType& type = *element.properties[vectors.position->front()].type;
  table.areFloats = !body.isText() && type.kind == 'F' && type.size == sizeof(float);

  constexpr std::size_t portion = 512; // stays in the fastest cache
  Columns columns(element.properties.size(), std::vector<double>(std::min(portion, count)));
  for (std::size_t done = 0; done < count; done += portion) {
    const std::size_t rows = std::min(portion, count - done);
    body.next(element, rows, columns);
    filler.add(rows, [&](std::size_t row, std::size_t column) { return columns[column][row]; });
  }
  filler.finish(vectors.color && element.properties[vectors.color->front()].type->kind != 'F');
}

/// Reads the vertex lists of an element; without `faces` only checks that the element is complete.
void readFaces(const Element& element, Body& body, Polygons* faces)
{
  for (double f = 0; f < element.count; ++f)
    for (const Property& property : element.properties) {
      const std::size_t count = property.isList() ? body.nextCount(property) : 1;
      const bool isWanted = faces != nullptr && property.isList() &&
                            (property.name == "vertex_indices" || property.name == "vertex_index");
      for (std::size_t i = 0; i < count; ++i) {
        const double value = body.next(*property.type);
        if (isWanted)
          faces->corners.push_back(isCount(value) ? static_cast<std::int64_t>(value) : -1);
      }
      if (isWanted)
        faces->close();
    }
}

} // namespace

PointTable readPly(const std::string& path, const std::string& text, Polygons* faces)
{
  const Header header = parseHeader(path, text);
  Body body(path, header.body, header.format);
  PointTable table;
  for (const Element& element : header.elements) {
    double min = 0;
    for (const Property& property : element.properties)
      min += static_cast<double>(body.minSize(*(property.isList() ? property.countType : property.type)));
    if (element.count * min > static_cast<double>(body.bytesLeft()))
      throw FileError(path, "is truncated: too short for what its header declares");
    if (element.properties.empty())
      continue;
    if (element.name == "vertex" && table.positions.empty())
      readVertices(path, element, body, table);
    else
      readFaces(element, body, element.name == "face" ? faces : nullptr);
  }
  if (table.positions.empty())
    throw FileError(path, "declares no vertices");
  return table;
}

} // namespace mrf_apps
