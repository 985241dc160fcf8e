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

/// The faces of a file. Flat arrays, because a face may take a single byte of the file.
struct Polygons {
  std::vector<std::int64_t> corners; ///< numbers of vertices, from 0; not checked
  std::vector<std::size_t> ends;     ///< end of each polygon in `corners`

  void close() { ends.push_back(corners.size()); }
};

/// A color channel of a file, rounded and clamped to a byte; 0 if it is not a number.
inline std::uint8_t toByte(double value)
{
  return value > 0 ? static_cast<std::uint8_t>(std::min(value + .5, 255.)) : std::uint8_t{0};
}

/// The numbers of three columns that make a vector.
using Triple = std::array<std::size_t, 3>;

/// The columns that make vectors, found by their names in any case: x y z or easting northing elevation, also with
/// words of the frame or the unit, world_x or x_m; nx ny nz or normal_x …, r g b, red … or diffuse_red …. A vector
/// needs all three parts.
struct VectorColumns {
  std::optional<Triple> position, normal, color;

  explicit VectorColumns(const std::vector<std::string>& names);
  bool hold(std::size_t column) const; ///< whether it is part of a vector
  static bool hasPart(const std::optional<Triple>& vector, std::size_t column);
};

/// Adds colors. Their largest channel tells the scale: 16-bit numbers from 256 on, bytes above 1, else fractions of 1.
/// \param areWhole their type is of whole numbers, so that they are no fractions
void addColors(const std::vector<Eigen::Vector3f>& colors, bool areWhole, PointTable& table);

/// Fills a table with rows of numbers, by the names of their columns.
class TableFiller {
public:
  /// \param names of the columns; those without one are skipped, and of two with the same name the first counts
  /// \param rows to reserve memory for
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

  /// Adds the colors, after the last row. \param areWhole as in addColors
  void finish(bool areWhole) { addColors(colors_, areWhole, table_); }

private:
  PointTable& table_;
  VectorColumns vectors_;
  std::vector<Eigen::Vector3f> colors_;
  std::vector<std::vector<float>*> scalars_; ///< of the table, by column; null: none
};

/// A type of numbers in a binary file.
struct NumberType {
  char kind;        ///< I, U or F, as PCD calls them
  std::size_t size; ///< bytes
  /// Decodes numbers that are `stride` bytes apart. \param isReversed the byte order is not the machine's
  void (*decode)(const char* from, std::size_t stride, std::size_t count, bool isReversed, double* to);
};

/// \return null if there is none
const NumberType* numberType(char kind, std::size_t size);

// The parsers get the path, for messages, and the whole file, which is not empty. All throw FileError. Whatever the
// header promises, they take at most a small multiple of the (unpacked) file's size as memory.

/// The names of columns in a line, which may be a comment: separated by commas, semicolons or tabs if it has any, else
/// by blanks; without units in brackets. \return empty unless x, y and z are among them
std::vector<std::string> columnNames(std::string_view line);

/// Parses rows of numbers; columns of text are skipped. The line above the rows may name the columns. Without names for
/// all columns they are [number] x y z [intensity], and normals and colors, which are recognized by their values. Lines
/// that start with # or // are comments; a leading line may hold the number of points, in Leica's PTS one per scan.
/// \param format pts: an intensity is before the colors, which a number of points suggests as well; xyzrgb: colors,
/// bytes or numbers up to 1, are behind the coordinates
PointTable parseXyz(const std::string& path, const std::string& text, const std::string& format = "xyz");

/// Parses Leica's PTX: scans of cells x y z intensity [r g b], transformed as their headers say. Cells at 0 0 0 are
/// skipped. The position of the scanner becomes the sensor of the scan's points.
PointTable parsePtx(const std::string& path, const std::string& text);

/// Parses LAS 1.0 to 1.4, not compressed: position, intensity and color of the points that are neither withheld nor
/// noise. Intensities or colors that are all zero are dropped.
PointTable parseLas(const std::string& path, const std::string& text);

/// Parses the vertices of a Wavefront OBJ file. Normals follow the indices of the faces and are averaged per vertex.
/// \param faces receives the faces, if not null
PointTable parseObj(const std::string& path, const std::string& text, Polygons* faces = nullptr);

/// Vertices of an OFF file in text, with the normals and colors that its first word announces (NOFF, COFF, CNOFF).
/// \param faces receives the faces, if not null
PointTable parseOff(const std::string& path, const std::string& text, Polygons* faces = nullptr);

/// Points of a PCD file (text, binary, binary_compressed), with all fields of one number per point.
PointTable readPcd(const std::string& path, const std::string& text);

/// Vertices of a PLY file, text or binary, with all scalar properties. \param faces receives the faces, if not null
PointTable readPly(const std::string& path, const std::string& text, Polygons* faces = nullptr);

/// Parses the corners of an STL file, text or binary, three per triangle, each as a point of its own; for meshes only.
/// An offset in the header, as our writer puts it there (offsetOfFloats), is added.
PointTable parseStl(const std::string& path, const std::string& text, Polygons& faces);

} // namespace mrf_apps
