// SPDX-License-Identifier: BSD-3-Clause
/// The points of a file as columns.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mrf_apps {

/// What a file says about its points. Optional columns are either empty or as long as `positions`.
struct PointTable {
  std::vector<Eigen::Vector3d> positions;
  bool areFloats = false; ///< the file holds the positions in single precision
  std::vector<Eigen::Vector3f> normals;
  std::vector<std::array<std::uint8_t, 3>> colors;
  std::map<std::string, std::vector<float>> scalars; ///< every other column, by its name in the file
  std::optional<Eigen::Vector3d> sensorOrigin;       ///< where the sensor was, if the file says so
  std::vector<Eigen::Vector3d> sensors;              ///< one for each scan, if the file has several
  std::vector<std::int32_t> views;                   ///< the sensor of each point, from 0, if there are `sensors`
  std::vector<std::string> notes;                    ///< what the user should know about how the file was understood
  std::vector<std::string> warnings;                 ///< which data of the file, or of joined files, were left out

  std::size_t size() const { return positions.size(); }
  bool hasIntensity() const { return scalars.count("intensity") != 0; }
};

/// Reads the points, or the vertices of a mesh, from a file of one of pointFormats, which gzip may have packed.
/// \param path "-" reads standard input
/// \param format one of pointFormats; empty: told by the name, or for standard input by its first bytes
/// \throw UsageError if the name tells no format
/// \throw FileError if the file is missing, unreadable, empty, truncated, or not what its extension says
PointTable readPoints(const std::string& path, const std::string& format = {});

/// The same for the bytes of a file. \param format also one of pointFormatOfName \param path for messages
PointTable parsePoints(const std::string& format, const std::string& path, const std::string& text);

/// The points of several files as one cloud. Columns that some file lacks are left out, normals too: the normals of
/// some points would decide the side of points far away. Equal sensors become one.
/// \param paths of the tables, for messages
PointTable joinPoints(std::vector<PointTable> tables, const std::vector<std::string>& paths);

/// The format that a file's first bytes look like, one of pointFormats; empty if unknown.
std::string pointFormatOf(std::string_view text);

/// The format that a file's name tells: one of pointFormats, or Open3D's xyzn or xyzrgb; empty if none.
std::string pointFormatOfName(const std::string& path);

/// Formats that readPoints knows: extensions in lower case.
extern const std::vector<std::string> pointFormats;

/// The same for messages.
extern const std::string pointFileExtensions;

/// Formats that writePoints knows.
extern const std::vector<std::string> pointOutputFormats;

/// Writes positions and, if there are any, normals as binary PLY or PCD. Positions are floats, or doubles where float
/// does not hold them (floatOffset). The bytes are the same everywhere, which PCL's and VTK's writers do not promise.
/// \param format extension, lower case, without the dot
/// \throw pcl::mrf::FileError
void writePoints(const PointTable& points, const std::string& path, const std::string& format);

} // namespace mrf_apps
