// SPDX-License-Identifier: BSD-3-Clause
// VTK's XML files of polygons. Not through VTK, whose reader takes the memory that a header asks for, and half of a
// file for the whole.
#include "errors.h"
#include "mesh_readers.h"
#include "text_file.h"

#include <vtkDataCompressor.h>
#include <vtkLZ4DataCompressor.h>
#include <vtkLZMADataCompressor.h>
#include <vtkObject.h>
#include <vtkSmartPointer.h>
#include <vtkZLibDataCompressor.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <map>

namespace mrf_apps {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& cause = {})
{
  throw FileError(path, "is a truncated or malformed VTP file" + (cause.empty() ? cause : ": " + cause));
}

/// An element of XML, from its start tag to its end tag.
struct Element {
  std::string_view name;
  std::map<std::string_view, std::string_view> attributes;
  std::string_view text; ///< between the start tag and the next tag
  std::vector<Element> children;

  std::string_view operator[](std::string_view attribute) const
  {
    const auto found = attributes.find(attribute);
    return found == attributes.end() ? std::string_view() : found->second;
  }

  /// The first child of this name, null if there is none.
  const Element* child(std::string_view wanted) const
  {
    for (const Element& element : children)
      if (element.name == wanted)
        return &element;
    return nullptr;
  }
};

/// As much of XML as such files have: elements, attributes, comments, declarations. The names and numbers that matter
/// need no entities.
class XmlParser {
public:
  XmlParser(const std::string& path, std::string_view text) : path_(path), rest_(text) {}

  /// The outermost element. AppendedData has no children, whatever its bytes look like.
  Element run()
  {
    skipToTag();
    Element root = element(0);
    skipToTag();
    if (!rest_.empty())
      fail(path_, "something follows its end");
    return root;
  }

private:
  static constexpr std::string_view blanks = " \t\r\n";

  /// Skips blanks, comments, declarations and instructions; other text in front of a tag as well.
  void skipToTag()
  {
    for (;;) {
      rest_.remove_prefix(std::min(rest_.find('<'), rest_.size()));
      if (rest_.substr(0, 4) == "<!--")
        skipBehind("-->");
      else if (rest_.substr(0, 2) == "<?" || rest_.substr(0, 2) == "<!")
        skipBehind(">");
      else
        return;
    }
  }

  void skipBehind(std::string_view end)
  {
    const std::size_t at = rest_.find(end);
    if (at == std::string_view::npos)
      fail(path_);
    rest_.remove_prefix(at + end.size());
  }

  void skipBlanks() { rest_.remove_prefix(std::min(rest_.find_first_not_of(blanks), rest_.size())); }

  char front() const
  {
    if (rest_.empty())
      fail(path_);
    return rest_.front();
  }

  void take(char expected)
  {
    if (front() != expected)
      fail(path_);
    rest_.remove_prefix(1);
  }

  std::string_view takeName()
  {
    const std::string_view name = rest_.substr(0, rest_.find_first_of(" \t\r\n=/><\"'"));
    if (name.empty())
      fail(path_);
    rest_.remove_prefix(name.size());
    return name;
  }

  void takeAttribute(Element& element)
  {
    const std::string_view name = takeName();
    skipBlanks();
    take('=');
    skipBlanks();
    const char quote = front();
    if (quote != '"' && quote != '\'')
      fail(path_);
    rest_.remove_prefix(1);
    const std::string_view value = rest_.substr(0, rest_.find(quote));
    rest_.remove_prefix(value.size());
    take(quote);
    if (!element.attributes.emplace(name, value).second)
      fail(path_, "an element has two attributes of one name");
  }

  Element element(int depth)
  {
    constexpr int deepest = 20;
    if (depth > deepest)
      fail(path_, "its elements are nested too deeply");
    Element result;
    take('<');
    result.name = takeName();
    for (skipBlanks(); front() != '>' && front() != '/'; skipBlanks())
      takeAttribute(result);
    const bool isEmpty = front() == '/';
    if (isEmpty)
      take('/');
    take('>');
    if (isEmpty)
      return result;
    if (result.name == "AppendedData") {
      takeAppended(result);
      return result;
    }
    result.text = rest_.substr(0, rest_.find('<'));
    for (skipToTag(); rest_.substr(0, 2) != "</"; skipToTag())
      result.children.push_back(element(depth + 1));
    takeEnd(result.name);
    return result;
  }

  void takeEnd(std::string_view name)
  {
    take('<');
    take('/');
    if (takeName() != name)
      fail(path_, "an element ends that did not begin");
    skipBlanks();
    take('>');
  }

  /// The bytes may be anything; the last end tag in the file is the element's.
  void takeAppended(Element& appended)
  {
    constexpr std::string_view end = "</AppendedData";
    const std::size_t at = rest_.rfind(end);
    if (at == std::string_view::npos)
      fail(path_);
    appended.text = rest_.substr(0, at);
    rest_.remove_prefix(at);
    takeEnd(appended.name);
  }

  const std::string& path_;
  std::string_view rest_;
};

/// Turns base64 into bytes, which are appended. \return false if they are not base64
bool decodeBase64(std::string_view text, std::string& bytes)
{
  std::array<std::uint32_t, 4> digits{};
  std::size_t count = 0, padding = 0;
  for (const char c : text) {
    const int digit = c >= 'A' && c <= 'Z'   ? c - 'A'
                      : c >= 'a' && c <= 'z' ? c - 'a' + 26
                      : c >= '0' && c <= '9' ? c - '0' + 52
                      : c == '+'             ? 62
                      : c == '/'             ? 63
                                             : -1;
    if (c == '=')
      ++padding;
    else if (digit < 0 || padding > 0)
      return false;
    digits[count++] = digit < 0 ? 0 : static_cast<std::uint32_t>(digit);
    if (count < 4)
      continue;
    const std::uint32_t bits = digits[0] << 18 | digits[1] << 12 | digits[2] << 6 | digits[3];
    if (padding > 2)
      return false;
    for (std::size_t byte = 0; byte < 3 - padding; ++byte)
      bytes.push_back(static_cast<char>(bits >> (16 - 8 * byte) & 255));
    count = 0;
  }
  return count == 0;
}

/// A sequence of bytes in a file that is read from front to back, plain or in base64.
class Source {
public:
  Source(std::string_view text, bool isBase64) : rest_(text), isBase64_(isBase64)
  {
    if (isBase64_)
      skipBlanks();
  }

  /// The next bytes; in base64 they end where their four characters end. \return false if they are not all there
  bool take(std::size_t count, std::string& bytes)
  {
    if (!isBase64_) {
      if (count > rest_.size())
        return false;
      bytes.assign(rest_.substr(0, count));
      rest_.remove_prefix(count);
      return true;
    }
    if (count / 3 > rest_.size() / 4)
      return false;
    const std::size_t characters = (count + 2) / 3 * 4;
    bytes.clear();
    if (characters > rest_.size() || !decodeBase64(rest_.substr(0, characters), bytes) || bytes.size() < count)
      return false;
    bytes.resize(count);
    rest_.remove_prefix(characters);
    return true;
  }

  /// At most so many bytes can follow.
  std::size_t bytesLeft() const { return isBase64_ ? rest_.size() / 4 * 3 : rest_.size(); }

private:
  void skipBlanks() { rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size())); }

  std::string_view rest_;
  bool isBase64_;
};

struct Type {
  const char* name;
  std::size_t size;
  bool isReal, isSigned;
};

constexpr std::array<Type, 10> types = {{{"Int8", 1, false, true},
                                         {"UInt8", 1, false, false},
                                         {"Int16", 2, false, true},
                                         {"UInt16", 2, false, false},
                                         {"Int32", 4, false, true},
                                         {"UInt32", 4, false, false},
                                         {"Int64", 8, false, true},
                                         {"UInt64", 8, false, false},
                                         {"Float32", 4, true, true},
                                         {"Float64", 8, true, true}}};

/// Reads the arrays of a file.
class ArrayReader {
public:
  /// \param fileSize bytes of the file
  ArrayReader(const std::string& path, const Element& root, std::size_t fileSize) : path_(path), unread_(fileSize)
  {
    isBigEndian_ = root["byte_order"] == "BigEndian";
    headerSize_ = root["header_type"] == "UInt64" ? 8 : 4;
    const std::string_view compressor = root["compressor"];
    if (compressor == "vtkZLibDataCompressor")
      compressor_ = vtkSmartPointer<vtkZLibDataCompressor>::New();
    else if (compressor == "vtkLZ4DataCompressor")
      compressor_ = vtkSmartPointer<vtkLZ4DataCompressor>::New();
    else if (compressor == "vtkLZMADataCompressor")
      compressor_ = vtkSmartPointer<vtkLZMADataCompressor>::New();
    else if (!compressor.empty())
      fail(path_, "its compressor is unknown");
    if (const Element* appended = root.child("AppendedData")) {
      const std::size_t mark = appended->text.find('_');
      if (mark == std::string_view::npos)
        fail(path_, "its appended data have no beginning");
      appended_ = appended->text.substr(mark + 1);
      appendedIsBase64_ = (*appended)["encoding"] != "raw";
    }
  }

  /// The numbers of an array, exactly so many.
  std::vector<double> read(const Element& array, std::size_t count)
  {
    const auto type = std::find_if(types.begin(), types.end(), [&](const Type& t) { return array["type"] == t.name; });
    if (type == types.end())
      fail(path_, "an array has an unknown type");
    const std::string_view format = array["format"];
    if (format == "ascii" || format.empty())
      return readText(array.text, count);
    bool isBase64 = true;
    std::string_view from = array.text;
    if (format == "appended") {
      std::int64_t offset = 0;
      if (!toCount(array["offset"], offset) || static_cast<std::size_t>(offset) > appended_.size())
        fail(path_, "an array lies outside of the appended data");
      from = appended_.substr(static_cast<std::size_t>(offset));
      isBase64 = appendedIsBase64_;
    } else if (format != "binary")
      fail(path_, "an array has an unknown format");
    const Source source(from, isBase64);
    const std::string bytes =
        compressor_ ? readCompressed(source, count, type->size) : readPlain(source, count, type->size);
    std::vector<double> values;
    values.reserve(count);
    for (std::size_t at = 0; at < bytes.size(); at += type->size)
      values.push_back(decode(*type, bytes.data() + at));
    return values;
  }

private:
  std::vector<double> readText(std::string_view text, std::size_t count) const
  {
    constexpr std::string_view blanks = " \t\r\n";
    std::vector<double> values;
    for (std::size_t begin = text.find_first_not_of(blanks); begin != std::string_view::npos;) {
      const std::size_t end = std::min(text.find_first_of(blanks, begin), text.size());
      double value = 0;
      if (!toNumber(text.substr(begin, end - begin), value))
        fail(path_);
      values.push_back(value);
      begin = text.find_first_not_of(blanks, end);
    }
    if (values.size() != count)
      fail(path_, "an array has not the size that the file declares");
    return values;
  }

  /// A number of a header.
  std::uint64_t headerNumber(const std::string& bytes, std::size_t number) const
  {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < headerSize_; ++i) {
      const std::size_t byte = isBigEndian_ ? i : headerSize_ - 1 - i;
      value = value << 8 | static_cast<std::uint8_t>(bytes[number * headerSize_ + byte]);
    }
    return value;
  }

  /// The number of bytes, then the bytes, in one piece of base64.
  std::string readPlain(Source source, std::size_t count, std::size_t size)
  {
    std::string bytes;
    Source again = source;
    if (!source.take(headerSize_, bytes) || count > std::numeric_limits<std::size_t>::max() / size / 2 ||
        headerNumber(bytes, 0) != count * size)
      fail(path_, "an array has not the size that the file declares");
    if (!again.take(headerSize_ + count * size, bytes))
      fail(path_);
    charge(bytes.size());
    return bytes.substr(headerSize_);
  }

  /// The number of blocks, the bytes of a whole one and of the last one if that is smaller, the packed bytes of each;
  /// then the blocks, in a piece of base64 of their own.
  std::string readCompressed(Source source, std::size_t count, std::size_t size)
  {
    std::string start, sizes, packed, bytes;
    Source again = source;
    if (!source.take(3 * headerSize_, start))
      fail(path_);
    const std::uint64_t blocks = headerNumber(start, 0), whole = headerNumber(start, 1), last = headerNumber(start, 2);
    if (blocks > again.bytesLeft() / headerSize_ || !again.take((3 + blocks) * headerSize_, sizes))
      fail(path_);
    std::uint64_t packedBytes = 0;
    for (std::size_t block = 0; block < blocks; ++block) {
      const std::uint64_t packedBlock = headerNumber(sizes, 3 + block);
      if (packedBlock > again.bytesLeft())
        fail(path_);
      packedBytes += packedBlock;
    }
    if (packedBytes > again.bytesLeft() || !again.take(static_cast<std::size_t>(packedBytes), packed))
      fail(path_);
    charge(sizes.size() + packed.size());
    std::size_t at = 0;
    for (std::size_t block = 0; block < blocks; ++block) {
      const std::uint64_t unpacked = block + 1 == blocks && last > 0 ? last : whole;
      const auto packedBlock = static_cast<std::size_t>(headerNumber(sizes, 3 + block));
      if (unpacked > count * size - bytes.size())
        fail(path_, "an array has not the size that the file declares");
      unpack({packed.data() + at, packedBlock}, static_cast<std::size_t>(unpacked), bytes);
      at += packedBlock;
    }
    if (bytes.size() != count * size)
      fail(path_, "an array has not the size that the file declares");
    return bytes;
  }

  /// No byte belongs to two arrays: else a small file could hold as much as it likes.
  void charge(std::size_t bytes)
  {
    if (bytes > unread_)
      fail(path_, "its arrays overlap");
    unread_ -= bytes;
  }

  /// Appends what a block unpacks to.
  void unpack(std::string_view packed, std::size_t size, std::string& bytes) const
  {
    // More than what any of the three has been seen to pack, so that a small block cannot ask for gigabytes.
    constexpr std::size_t largestRatio = 8192;
    if (size / largestRatio > packed.size())
      fail(path_);
    const std::size_t before = bytes.size();
    bytes.resize(before + size);
    vtkObject::GlobalWarningDisplayOff();
    const std::size_t written =
        compressor_->Uncompress(reinterpret_cast<const unsigned char*>(packed.data()), packed.size(),
                                reinterpret_cast<unsigned char*>(bytes.data() + before), size);
    vtkObject::GlobalWarningDisplayOn();
    if (written != size)
      fail(path_, "a block cannot be unpacked");
  }

  double decode(const Type& type, const char* bytes) const
  {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < type.size; ++i)
      bits = bits << 8 | static_cast<std::uint8_t>(bytes[isBigEndian_ ? i : type.size - 1 - i]);
    if (type.isReal && type.size == 8) {
      double value = 0;
      std::memcpy(&value, &bits, sizeof(value));
      return value;
    }
    if (type.isReal) {
      const auto half = static_cast<std::uint32_t>(bits);
      float value = 0;
      std::memcpy(&value, &half, sizeof(value));
      return value;
    }
    const std::size_t unused = 64 - 8 * type.size;
    return type.isSigned ? static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused)
                         : static_cast<double>(bits);
  }

  const std::string& path_;
  std::size_t unread_;
  bool isBigEndian_ = false;
  std::size_t headerSize_ = 4;
  vtkSmartPointer<vtkDataCompressor> compressor_; ///< null: none
  std::string_view appended_;
  bool appendedIsBase64_ = false;
};

std::size_t countOf(const std::string& path, const Element& piece, std::string_view attribute)
{
  std::int64_t count = 0;
  const std::string_view word = piece[attribute];
  if (!word.empty() && (!toCount(word, count) || count > std::numeric_limits<std::int32_t>::max()))
    fail(path, std::string(attribute) + " is no number of theirs");
  return static_cast<std::size_t>(count);
}

/// The array of this name in a part of a piece.
const Element& arrayOf(const std::string& path, const Element& part, std::string_view name)
{
  for (const Element& array : part.children)
    if (array.name == "DataArray" && (array["Name"] == name || part.name == "Points"))
      return array;
  fail(path, "the array " + std::string(name) + " is missing");
}

/// The cells of one kind, counted from `firstVertex`.
Polygons readCells(const std::string& path, ArrayReader& arrays, const Element& piece, const char* kind,
                   std::size_t count, std::size_t firstVertex)
{
  Polygons cells;
  const Element* part = piece.child(kind);
  if (count == 0)
    return cells;
  if (part == nullptr)
    fail(path, std::string(kind) + " is missing");
  double last = 0;
  for (const double end : arrays.read(arrayOf(path, *part, "offsets"), count)) {
    if (!isCount(end) || end < last)
      fail(path, "its offsets of cells do not rise");
    cells.ends.push_back(static_cast<std::size_t>(end));
    last = end;
  }
  for (const double corner : arrays.read(arrayOf(path, *part, "connectivity"), static_cast<std::size_t>(last)))
    cells.corners.push_back(isCount(corner) ? static_cast<std::int64_t>(corner) + static_cast<std::int64_t>(firstVertex)
                                            : -1);
  return cells;
}

} // namespace

SurfaceMesh parseVtp(const std::string& path, const std::string& text)
{
  if (text.find("<VTKFile") == std::string::npos)
    throw FileError(path, "is not a VTP file");
  const Element root = XmlParser(path, text).run();
  const Element* data = root.child("PolyData");
  if (root.name != "VTKFile" || data == nullptr)
    throw FileError(path, "holds no polygons: it is not a VTK file of type PolyData");
  ArrayReader arrays(path, root, text.size());
  SurfaceMesh mesh;
  for (const Element& piece : data->children) {
    const std::size_t points = piece.name == "Piece" ? countOf(path, piece, "NumberOfPoints") : 0;
    if (points == 0)
      continue;
    const Element* part = piece.child("Points");
    if (part == nullptr)
      fail(path, "its points are missing");
    const std::size_t before = mesh.vertices.size();
    const std::vector<double> values = arrays.read(arrayOf(path, *part, "Points"), 3 * points);
    for (std::size_t v = 0; v < points; ++v)
      mesh.vertices.emplace_back(values[3 * v], values[3 * v + 1], values[3 * v + 2]);
    addPolygons(path, readCells(path, arrays, piece, "Polys", countOf(path, piece, "NumberOfPolys"), before), mesh);
    addStrips(path, readCells(path, arrays, piece, "Strips", countOf(path, piece, "NumberOfStrips"), before), mesh);
  }
  return mesh;
}

} // namespace mrf_apps
