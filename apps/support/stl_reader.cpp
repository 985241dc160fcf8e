// SPDX-License-Identifier: BSD-3-Clause
// Reads STL. VTK's reader is not used: it allocates what the header asks for, and accepts half a file as whole.
#include "errors.h"
#include "point_readers.h"
#include "surface_mesh.h"
#include "text_file.h"

#include <algorithm>
#include <cstring>

namespace mrf_apps {
namespace {

constexpr std::size_t headerBytes = 80, facetBytes = 50;

/// The corners of the triangles, three by three.
using Corners = std::vector<Eigen::Vector3d>;

bool isBinary(const std::string& text)
{
  // Binary files may start with "solid" as well; their length tells.
  std::uint32_t count = 0;
  if (text.size() < headerBytes + sizeof(count))
    return false;
  std::memcpy(&count, text.data() + headerBytes, sizeof(count));
  return text.size() == headerBytes + sizeof(count) + std::uint64_t{count} * facetBytes;
}

/// The offset that our writer subtracted from the vertices, see offsetOfFloats.
Eigen::Vector3d offsetIn(std::string_view header)
{
  header = header.substr(0, header.find('\0'));
  std::vector<std::string_view> words;
  std::vector<double> values;
  const std::string_view mark = stlOffsetMark;
  if (header.substr(0, mark.size()) != mark)
    return Eigen::Vector3d::Zero();
  split(header.substr(mark.size()), words);
  if (!toNumbers(words, values) || values.size() != 3)
    return Eigen::Vector3d::Zero();
  return {values[0], values[1], values[2]};
}

Corners binaryCorners(const std::string& text)
{
  const Eigen::Vector3d offset = offsetIn(std::string_view(text).substr(0, headerBytes));
  constexpr std::size_t normalBytes = 12;
  Corners corners;
  for (std::size_t facet = headerBytes + sizeof(std::uint32_t); facet < text.size(); facet += facetBytes)
    for (std::size_t corner = 0; corner < 3; ++corner) {
      Eigen::Vector3f vertex;
      std::memcpy(vertex.data(), text.data() + facet + normalBytes + corner * sizeof(vertex), sizeof(vertex));
      corners.emplace_back(vertex.cast<double>() + offset);
    }
  return corners;
}

/// Reads the words of a text file in order.
class Words {
public:
  Words(const std::string& path, std::string_view text) : path_(path), text_(text), rest_(text) {}

  /// The next word; empty at the end of the file.
  std::string_view next() { return takeWord(rest_); }

  void expect(std::initializer_list<std::string_view> expected)
  {
    for (const std::string_view word : expected)
      if (!equalsIgnoringCase(next(), word))
        fail();
  }

  double number()
  {
    double value = 0;
    if (!toNumber(next(), value))
      fail();
    return value;
  }

  void skipLine() { rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size())); }

  [[noreturn]] void fail() const
  {
    const auto line = 1 + std::count(text_.data(), rest_.data(), '\n');
    throw FileError(path_, "is a truncated or malformed STL file at line " + std::to_string(line));
  }

private:
  const std::string& path_;
  std::string_view text_, rest_; ///< the whole text, and its part behind the last word
};

Corners textCorners(const std::string& path, const std::string& text)
{
  Words words(path, text);
  if (!equalsIgnoringCase(words.next(), "solid"))
    throw FileError(path, "is truncated, or not an STL file");
  Corners corners;
  // A file may hold several solids.
  std::string_view word = "solid";
  for (; equalsIgnoringCase(word, "solid"); word = words.next()) {
    words.skipLine(); // its name
    for (word = words.next(); equalsIgnoringCase(word, "facet"); word = words.next()) {
      words.expect({"normal"});
      for (int axis = 0; axis < 3; ++axis)
        words.number();
      words.expect({"outer", "loop"});
      for (int corner = 0; corner < 3; ++corner) {
        words.expect({"vertex"});
        const double x = words.number(), y = words.number(), z = words.number();
        corners.emplace_back(x, y, z);
      }
      words.expect({"endloop", "endfacet"});
    }
    if (!equalsIgnoringCase(word, "endsolid"))
      words.fail();
    words.skipLine();
  }
  if (!word.empty())
    words.fail();
  return corners;
}

} // namespace

PointTable parseStl(const std::string& path, const std::string& text, Polygons& faces)
{
  PointTable table;
  table.positions = isBinary(text) ? binaryCorners(text) : textCorners(path, text);
  for (std::size_t corner = 0; corner < table.size(); ++corner) {
    faces.corners.push_back(static_cast<std::int64_t>(corner));
    if (corner % 3 == 2)
      faces.close();
  }
  return table;
}

} // namespace mrf_apps
