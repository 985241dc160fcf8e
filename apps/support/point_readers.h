// SPDX-License-Identifier: BSD-3-Clause
/// The readers behind readPoints and readMesh, one per file format.
#pragma once

#include "point_table.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace mrf_apps {

/// The faces of a file. Flat, because a face may take a single byte of it.
struct Polygons {
  std::vector<std::int64_t> corners; ///< numbers of vertices, from 0; not checked
  std::vector<std::size_t> ends;     ///< of each polygon, in `corners`

  void close() { ends.push_back(corners.size()); }
};

/// A color channel out of a file: rounded, kept within what a byte holds; 0 if it is not a number.
inline std::uint8_t toByte(double value)
{
  return value > 0 ? static_cast<std::uint8_t>(std::min(value + .5, 255.)) : std::uint8_t{0};
}

/// Three columns that make a vector, by their numbers.
using Triple = std::array<std::size_t, 3>;

/// The columns that make vectors, by what files call their parts, in any case: x y z or easting northing elevation,
/// also with words of the frame or the unit, world_x or x_m; nx ny nz or normal_x …, r g b, red … or diffuse_red ….
/// There is a vector where all three parts are.
struct VectorColumns {
  std::optional<Triple> position, normal, color;

  explicit VectorColumns(const std::vector<std::string>& names);
  bool hold(std::size_t column) const; ///< whether it is part of a vector
  static bool hasPart(const std::optional<Triple>& vector, std::size_t column);
};

/// Colors are bytes; 16-bit numbers, up to 257 times as large, where any is above; or shares of 1 where none is above
/// that. \param areWhole they have a type that has no shares
void addColors(const std::vector<Eigen::Vector3f>& colors, bool areWhole, PointTable& table);

/// Makes a table of rows of numbers, by what their columns are called.
class TableFiller {
public:
  /// \param names of the columns; those without one are skipped, and of two with the same name the first counts
  /// \param rows that are going to be added
  TableFiller(const std::vector<std::string>& names, std::size_t rows, PointTable& table);

  const VectorColumns& vectors() const { return vectors_; }

  /// Adds rows. \param at returns the number in a row and a column
  template <typename At>
  void add(std::size_t rows, const At& at)
  {
    const auto addVectors = [&](const std::optional<Triple>& parts, auto& vectors) {
      using Scalar = typename std::decay_t<decltype(vectors)>::value_type::Scalar;
      for (std::size_t row = 0; parts && row < rows; ++row)
        vectors.push_back(
            Eigen::Vector3d(at(row, (*parts)[0]), at(row, (*parts)[1]), at(row, (*parts)[2])).template cast<Scalar>());
    };
    addVectors(vectors_.position, table_.positions);
    addVectors(vectors_.normal, table_.normals);
    addVectors(vectors_.color, colors_);
    for (std::size_t column = 0; column < scalars_.size(); ++column)
      for (std::size_t row = 0; scalars_[column] != nullptr && row < rows; ++row)
        scalars_[column]->push_back(static_cast<float>(at(row, column)));
  }

  /// Adds the colors, when all rows are there. \param areWhole as above
  void finish(bool areWhole) { addColors(colors_, areWhole, table_); }

private:
  PointTable& table_;
  VectorColumns vectors_;
  std::vector<Eigen::Vector3f> colors_;
  std::vector<std::vector<float>*> scalars_; ///< of the table, by column
};

/// A type of numbers in a binary file.
struct NumberType {
  char kind;        ///< I, U or F, as PCD calls them
  std::size_t size; ///< bytes
  /// Numbers that are `stride` bytes apart. \param isReversed their bytes are in the other order than the machine's
  void (*decode)(const char* from, std::size_t stride, std::size_t count, bool isReversed, double* to);
};

/// \return null if there is none
const NumberType* numberType(char kind, std::size_t size);

// Each is given the path, for its messages, and the whole file, which is not empty. All throw FileError. None takes
// more memory than a small multiple of what the file holds (once unpacked), whatever its header promises.

/// The names of columns in a line, parted by commas, semicolons or tabs if it has any, else by blanks, and without
/// units in brackets. It may be a comment. \return nothing unless x, y and z are among them
std::vector<std::string> columnNames(std::string_view line);

/// Rows of numbers; columns of text are skipped. Columns are what the line above them names; without names [number] x y
/// z [intensity] and normals and colors, which are told by their values, or in a line of three. Lines that start with #
/// or // are comments; a leading line may hold the number of points, as in Leica's PTS, where each scan has one.
/// \param format pts has an intensity before the colors, as a number of points says as well; xyzrgb colors, of bytes or
/// up to 1, behind the coordinates
PointTable parseXyz(const std::string& path, const std::string& text, const std::string& format = "xyz");

/// Leica's PTX: scans of cells x y z intensity [r g b], moved to where their headers say; those at 0 0 0 are none. The
/// scanners are the sensors of their points.
PointTable parsePtx(const std::string& path, const std::string& text);

/// LAS 1.0 to 1.4, not compressed: position, intensity and color of the points that are not withheld; intensities or
/// colors that are all zero are none.
PointTable parseLas(const std::string& path, const std::string& text);

/// Vertices of a Wavefront OBJ file. Normals follow the indices of the faces and are averaged per vertex.
/// Not PCL's reader: that one pairs vertices and normals by their order in the file.
/// \param faces receives the faces, if not null
PointTable parseObj(const std::string& path, const std::string& text, Polygons* faces = nullptr);

/// Vertices of an OFF file in text, with the normals and colors that its first word announces (NOFF, COFF, CNOFF).
/// \param faces receives the faces, if not null
PointTable parseOff(const std::string& path, const std::string& text, Polygons* faces = nullptr);

/// Points of a PCD file (text, binary, binary_compressed), with all fields of one number per point.
PointTable readPcd(const std::string& path, const std::string& text);

/// Vertices of a PLY file, text or binary, with all scalar properties. \param faces receives the faces, if not null
PointTable readPly(const std::string& path, const std::string& text, Polygons* faces = nullptr);

/// The corners of an STL file, text or binary, three by three, each a point of its own; for meshes only. Our own header
/// of a shifted file shifts it back (offsetOfFloats).
PointTable parseStl(const std::string& path, const std::string& text, Polygons& faces);

} // namespace mrf_apps
