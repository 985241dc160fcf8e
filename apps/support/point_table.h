/// \file
/// \brief Points of a file as columns.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace mrf_apps {

/// What a file says about its points. Optional columns are either empty or as long as `positions`.
struct PointTable {
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Vector3f> normals;
  std::vector<std::array<std::uint8_t, 3>> colours;
  std::map<std::string, std::vector<float>> scalars; ///< every other column, by its name in the file
  std::optional<Eigen::Vector3d> sensorOrigin;       ///< where the sensor was, if the file says so
  std::vector<std::string> notes;                    ///< what the user should know about how the file was understood

  std::size_t size() const { return positions.size(); }
  bool hasIntensity() const { return scalars.count("intensity") != 0; }
};

/// Reads the points of a PCD, PLY, OBJ, XYZ or TXT file, or the vertices of a mesh in one; chosen by the extension.
/// \throw UsageError if the extension is none of these
/// \throw FileError if the file is missing, unreadable, empty, truncated, or not what its extension says
PointTable readPoints(const std::string& path);

/// Extensions that readPoints knows, for messages.
extern const char* const pointFileExtensions;

/// What to subtract from the positions before they are rounded to float: zero where float holds them to 10⁻⁷ of the
/// bounding box's diagonal, else the centre of the box (survey coordinates from text or double-precision files).
Eigen::Vector3d floatOffset(const std::vector<Eigen::Vector3d>& positions);

} // namespace mrf_apps
