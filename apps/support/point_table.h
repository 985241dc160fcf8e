// SPDX-License-Identifier: BSD-3-Clause
/// Points of a file as columns.
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
  bool areFloats = false; ///< the file holds the positions in single precision, which has lost what it loses
  std::vector<Eigen::Vector3f> normals;
  std::vector<std::array<std::uint8_t, 3>> colors;
  std::map<std::string, std::vector<float>> scalars; ///< every other column, by its name in the file
  std::optional<Eigen::Vector3d> sensorOrigin;       ///< where the sensor was, if the file says so
  std::vector<Eigen::Vector3d> sensors;              ///< of a file of several scans instead
  std::vector<std::int32_t> views;                   ///< the sensor of each point, from 0, if there are `sensors`
  std::vector<std::string> notes;                    ///< what the user should know about how the file was understood
  std::vector<std::string> warnings;                 ///< what was left out of the file, or of joined ones

  std::size_t size() const { return positions.size(); }
  bool hasIntensity() const { return scalars.count("intensity") != 0; }
};

/// Reads the points of a file of one of pointFormats(), or the vertices of a mesh in one; gzip may have packed it.
/// \param path "-" reads standard input
/// \param format one of pointFormats(); empty: by the name, or of standard input by what it begins with
/// \throw UsageError if the name tells no format
/// \throw FileError if the file is missing, unreadable, empty, truncated, or not what its extension says
PointTable readPoints(const std::string& path, const std::string& format = {});

/// The same for the bytes of a file. \param format also as pointFormatOfName tells it \param path for messages
PointTable parsePoints(const std::string& format, const std::string& path, const std::string& text);

/// The points of several files as one cloud. What not all files have is left out, normals as well: some would decide
/// about the side of others that are far away. Equal sensors become one.
/// \param paths of the tables, for messages
PointTable joinPoints(std::vector<PointTable> tables, const std::vector<std::string>& paths);

/// What the bytes of a file look like, as one of pointFormats(). \return empty if like none
std::string pointFormatOf(std::string_view text);

/// What the name of a file says it is: one of pointFormats(), or Open3D's xyzn or xyzrgb. \return empty if none
std::string pointFormatOfName(const std::string& path);

/// Formats that readPoints knows: extensions in lower case.
const std::vector<std::string>& pointFormats();

/// The same for messages.
extern const char* const pointFileExtensions;

/// True if writePoints knows the extension (lower case, without the dot).
bool isWritableCloud(const std::string& extension);

/// Extensions that writePoints knows, for messages.
extern const char* const pointOutputExtensions;

/// Writes positions and, if there are any, normals as binary PLY or PCD. Positions are floats, or doubles where float
/// does not hold them (floatOffset). The same bytes everywhere, which PCL's and VTK's writers do not promise.
/// \param format extension, lower case, without the dot
/// \throw pcl::mrf::FileError
void writePoints(const PointTable& points, const std::string& path, const std::string& format);

} // namespace mrf_apps
