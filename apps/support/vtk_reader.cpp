// SPDX-License-Identifier: BSD-3-Clause
// Legacy VTK. Not through VTK, whose reader crashes on malformed files.
#include "errors.h"
#include "mesh_readers.h"
#include "text_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace mrf_apps {
namespace {

enum class Kind { signedInteger, unsignedInteger, real, bit, string };

struct Type {
  const char* name;
  Kind kind;
  std::size_t size; ///< bytes in a binary file
};

/// vtkIdType is written as int.
constexpr std::array<Type, 18> types = {{{"bit", Kind::bit, 0},
                                         {"char", Kind::signedInteger, 1},
                                         {"signed_char", Kind::signedInteger, 1},
                                         {"unsigned_char", Kind::unsignedInteger, 1},
                                         {"short", Kind::signedInteger, 2},
                                         {"unsigned_short", Kind::unsignedInteger, 2},
                                         {"int", Kind::signedInteger, 4},
                                         {"unsigned_int", Kind::unsignedInteger, 4},
                                         {"vtkIdType", Kind::signedInteger, 4},
                                         {"long", Kind::signedInteger, 8},
                                         {"unsigned_long", Kind::unsignedInteger, 8},
                                         {"vtktypeint64", Kind::signedInteger, 8},
                                         {"vtktypeuint64", Kind::unsignedInteger, 8},
                                         {"float", Kind::real, 4},
                                         {"double", Kind::real, 8},
                                         {"string", Kind::string, 0},
                                         {"utf8_string", Kind::string, 0},
                                         {"unicode_string", Kind::string, 0}}};

/// A whole number of big-endian bytes.
std::uint64_t bigEndian(std::string_view bytes)
{
  std::uint64_t value = 0;
  for (const char byte : bytes)
    value = value << 8 | static_cast<std::uint8_t>(byte);
  return value;
}

double decode(const Type& type, std::string_view bytes)
{
  const std::uint64_t bits = bigEndian(bytes);
  if (type.kind == Kind::unsignedInteger)
    return static_cast<double>(bits);
  if (type.kind == Kind::signedInteger) {
    const std::size_t unused = 64 - 8 * type.size;
    return static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused);
  }
  if (type.size == 8) {
    double value = 0;
    std::memcpy(&value, &bits, sizeof(value));
    return value;
  }
  const auto half = static_cast<std::uint32_t>(bits);
  float value = 0;
  std::memcpy(&value, &half, sizeof(value));
  return value;
}

/// Reads the file from front to back, section by section; what is not understood is an error.
class VtkParser {
public:
  VtkParser(const std::string& path, std::string_view text) : path_(path), rest_(text) {}

  SurfaceMesh run()
  {
    parseHeader();
    SurfaceMesh mesh;
    Polygons polygons, strips;
    bool hasPoints = false;
    double tuples = -1; // of the attributes; −1 before them
    for (std::string_view keyword = nextWord(); !keyword.empty(); keyword = nextWord()) {
      const auto is = [&](std::string_view word) { return equalsIgnoringCase(keyword, word); };
      if (is("METADATA"))
        skipMetadata();
      else if (is("FIELD"))
        skipField();
      else if (is("POINTS") && !hasPoints) {
        hasPoints = true;
        mesh.vertices = readPoints();
      } else if (is("VERTICES") || is("LINES"))
        readCells();
      else if (is("POLYGONS"))
        append(readCells(), polygons);
      else if (is("TRIANGLE_STRIPS"))
        append(readCells(), strips);
      else if (is("POINT_DATA") || is("CELL_DATA"))
        tuples = nextCount();
      else if (tuples < 0 || !skipAttribute(keyword, tuples))
        fail("'" + std::string(keyword.substr(0, 40)) + "' is no section of it");
    }
    if (!hasPoints)
      throw FileError(path_, "is truncated, or has no points");
    addPolygons(path_, polygons, mesh);
    addStrips(path_, strips, mesh);
    return mesh;
  }

private:
  [[noreturn]] void fail(const std::string& cause = {}) const
  {
    throw FileError(path_, "is a truncated or malformed VTK file" + (cause.empty() ? cause : ": " + cause));
  }

  void parseHeader()
  {
    const std::string_view magic = "# vtk DataFile Version ";
    const std::string_view first = nextLine();
    double version = 0;
    if (first.substr(0, magic.size()) != magic)
      throw FileError(path_, "is not a legacy VTK file");
    split(first.substr(magic.size()), words_);
    if (words_.size() != 1 || !toNumber(words_[0], version) || !(version >= 1 && version < 6))
      fail("its version is unknown");
    hasOffsets_ = version >= 5;
    nextLine(); // the title
    const std::string_view encoding = nextWord();
    binary_ = equalsIgnoringCase(encoding, "BINARY");
    if (!binary_ && !equalsIgnoringCase(encoding, "ASCII"))
      fail("it is neither ASCII nor BINARY");
    // Fields may come before the data set's type.
    std::string_view keyword = nextWord();
    for (; equalsIgnoringCase(keyword, "FIELD") || equalsIgnoringCase(keyword, "METADATA"); keyword = nextWord())
      equalsIgnoringCase(keyword, "FIELD") ? skipField() : skipMetadata();
    if (!equalsIgnoringCase(keyword, "DATASET"))
      fail("its data set is missing");
    if (!equalsIgnoringCase(nextWord(), "POLYDATA"))
      throw FileError(path_, "holds no polygons: its data set is not POLYDATA");
  }

  std::string_view nextLine()
  {
    const std::size_t end = rest_.find('\n');
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    return line.substr(0, line.find('\r'));
  }

  /// The next word, on whatever line; empty at the end of the file.
  std::string_view nextWord()
  {
    constexpr std::string_view blanks = " \t\r\n";
    rest_.remove_prefix(std::min(rest_.find_first_not_of(blanks), rest_.size()));
    const std::string_view word = rest_.substr(0, rest_.find_first_of(blanks));
    rest_.remove_prefix(word.size());
    return word;
  }

  double nextNumber()
  {
    double value = 0;
    if (!toNumber(nextWord(), value))
      fail();
    return value;
  }

  double nextCount()
  {
    const double value = nextNumber();
    if (!isCount(value))
      fail();
    return value;
  }

  const Type& nextType()
  {
    const std::string_view word = nextWord();
    const auto found =
        std::find_if(types.begin(), types.end(), [&](const Type& type) { return equalsIgnoringCase(word, type.name); });
    if (found == types.end())
      fail("there is no type '" + std::string(word.substr(0, 40)) + "'");
    return *found;
  }

  /// Calls use(value) on numbers that follow.
  template <typename Use>
  void readNumbers(double count, const Type& type, const Use& use)
  {
    if (type.kind == Kind::string || type.kind == Kind::bit)
      fail("bits or strings are where numbers are needed");
    if (!binary_) {
      for (double i = 0; i < count; ++i)
        use(nextNumber());
      return;
    }
    const std::string_view bytes = takeBytes(count * static_cast<double>(type.size));
    for (std::size_t at = 0; at < bytes.size(); at += type.size)
      use(decode(type, bytes.substr(at, type.size)));
  }

  /// The bytes behind the end of the current line.
  std::string_view takeBytes(double count)
  {
    if (!nextLineIsEmpty() || count > static_cast<double>(rest_.size()))
      fail();
    const std::string_view bytes = rest_.substr(0, static_cast<std::size_t>(count));
    rest_.remove_prefix(bytes.size());
    return bytes;
  }

  bool nextLineIsEmpty() { return nextLine().find_first_not_of(" \t") == std::string_view::npos; }

  void skipNumbers(double count, const Type& type)
  {
    if (type.kind == Kind::string)
      skipStrings(count);
    else if (type.kind != Kind::bit)
      readNumbers(count, type, [](double) {});
    else if (binary_)
      takeBytes(std::ceil(count / 8));
    else
      for (double i = 0; i < count; ++i)
        nextNumber();
  }

  /// In text one a line; in binary files each behind its length, whose two highest bits tell in how many bytes it is.
  void skipStrings(double count)
  {
    if (!nextLineIsEmpty())
      fail();
    for (double i = 0; i < count; ++i) {
      if (rest_.empty())
        fail();
      if (!binary_) {
        nextLine();
        continue;
      }
      constexpr std::array<std::size_t, 4> lengthBytes = {8, 4, 2, 1};
      const std::size_t bytes = lengthBytes[static_cast<std::uint8_t>(rest_[0]) >> 6];
      const std::uint64_t length = bigEndian(rest_.substr(0, bytes)) & ~(std::uint64_t{3} << (8 * bytes - 2));
      if (bytes > rest_.size() || length > rest_.size() - bytes)
        fail();
      rest_.remove_prefix(bytes + static_cast<std::size_t>(length));
    }
  }

  /// Up to an empty line.
  void skipMetadata()
  {
    nextLine();
    while (!rest_.empty() && !nextLineIsEmpty()) {
    }
  }

  /// Arrays: name, components, tuples, type, numbers. Each may have metadata.
  void skipField()
  {
    nextWord(); // its name
    for (double array = nextCount(); array > 0; --array) {
      std::string_view name = nextWord();
      if (equalsIgnoringCase(name, "METADATA")) {
        skipMetadata();
        name = nextWord();
      }
      if (name.empty())
        fail();
      // An array that is not there.
      if (name == "NULL_ARRAY")
        continue;
      const double components = nextCount(), tuples = nextCount();
      const Type& type = nextType();
      skipNumbers(components * tuples, type);
    }
  }

  /// \return false if the keyword is that of no attribute
  bool skipAttribute(std::string_view keyword, double tuples)
  {
    const auto is = [&](std::string_view word) { return equalsIgnoringCase(keyword, word); };
    constexpr Type real = {"float", Kind::real, 4}, byte = {"unsigned_char", Kind::unsignedInteger, 1};
    const Type& packed = binary_ ? byte : real; // colors
    if (is("SCALARS")) {
      skipScalars(tuples);
      return true;
    }
    const bool isColor = is("COLOR_SCALARS"), isTable = is("LOOKUP_TABLE"), isTexture = is("TEXTURE_COORDINATES");
    const double components = is("VECTORS") || is("NORMALS")                               ? 3
                              : is("TENSORS")                                              ? 9
                              : is("TENSORS6")                                             ? 6
                              : isTable                                                    ? 4
                              : is("GLOBAL_IDS") || is("PEDIGREE_IDS") || is("EDGE_FLAGS") ? 1
                              : isColor || isTexture                                       ? 0
                                                                                           : -1;
    if (components < 0)
      return false;
    nextWord(); // the name
    if (isTable)
      skipNumbers(components * nextCount(), packed);
    else if (isColor)
      skipNumbers(nextCount() * tuples, packed);
    else {
      const double values = isTexture ? nextCount() : components;
      skipNumbers(values * tuples, nextType());
    }
    return true;
  }

  /// Name, type, maybe a number of components, maybe the name of a table of colors on a line of its own.
  void skipScalars(double tuples)
  {
    nextWord();
    const Type& type = nextType();
    const std::string_view line = rest_.substr(0, rest_.find('\n'));
    double components = 1;
    split(line.substr(0, line.find('\r')), words_);
    if (words_.size() > 1 || (words_.size() == 1 && (!toNumber(words_[0], components) || !isCount(components))))
      fail();
    rest_.remove_prefix(line.size());
    const std::string_view behind = rest_;
    if (equalsIgnoringCase(nextWord(), "LOOKUP_TABLE"))
      nextWord();
    else
      rest_ = behind;
    skipNumbers(components * tuples, type);
  }

  std::vector<Eigen::Vector3d> readPoints()
  {
    const double count = nextCount();
    const Type& type = nextType();
    std::vector<Eigen::Vector3d> points;
    Eigen::Vector3d point;
    int axis = 0;
    readNumbers(3 * count, type, [&](double value) {
      point[axis++] = value;
      if (axis < 3)
        return;
      points.push_back(point);
      axis = 0;
    });
    return points;
  }

  Polygons readCells()
  {
    const double first = nextCount(), second = nextCount();
    return hasOffsets_ ? readOffsetCells(first, second) : readCountedCells(first, second);
  }

  /// Before version 5: each cell is its number of corners and the corners.
  Polygons readCountedCells(double cells, double size)
  {
    Polygons result;
    std::int64_t missing = 0; // corners of the current cell
    constexpr Type index = {"int", Kind::signedInteger, 4};
    readNumbers(size, index, [&](double value) {
      if (missing > 0) {
        result.corners.push_back(isCount(value) ? static_cast<std::int64_t>(value) : -1);
        --missing;
      } else {
        if (!isCount(value))
          fail();
        missing = static_cast<std::int64_t>(value);
        result.ends.push_back(result.corners.size() + static_cast<std::size_t>(missing));
      }
    });
    if (missing > 0 || static_cast<double>(result.ends.size()) != cells)
      fail("its cells do not have the size that it declares");
    return result;
  }

  /// From version 5 on: where each cell begins, and the last one ends, then the corners of all.
  Polygons readOffsetCells(double offsets, double size)
  {
    Polygons result;
    double last = 0;
    bool isFirst = true;
    readNamed("OFFSETS", offsets, [&](double value) {
      if (!isCount(value) || value < last || (isFirst && value != 0))
        fail("its offsets of cells do not rise from 0");
      if (!isFirst)
        result.ends.push_back(static_cast<std::size_t>(value));
      last = value;
      isFirst = false;
    });
    if (last != size)
      fail("its offsets of cells do not end where their corners do");
    readNamed("CONNECTIVITY", size,
              [&](double value) { result.corners.push_back(isCount(value) ? static_cast<std::int64_t>(value) : -1); });
    return result;
  }

  template <typename Use>
  void readNamed(std::string_view name, double count, const Use& use)
  {
    if (!equalsIgnoringCase(nextWord(), name))
      fail(std::string(name) + " is missing");
    const Type& type = nextType();
    readNumbers(count, type, use);
  }

  static void append(const Polygons& more, Polygons& all)
  {
    const std::size_t before = all.corners.size();
    all.corners.insert(all.corners.end(), more.corners.begin(), more.corners.end());
    for (const std::size_t end : more.ends)
      all.ends.push_back(before + end);
  }

  const std::string& path_;
  std::string_view rest_;
  bool binary_ = false;
  bool hasOffsets_ = false; ///< version 5
  std::vector<std::string_view> words_;
};

} // namespace

SurfaceMesh parseVtk(const std::string& path, const std::string& text)
{
  return VtkParser(path, text).run();
}

} // namespace mrf_apps
