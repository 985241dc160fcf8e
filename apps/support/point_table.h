/// \file
/// \brief Points of a file as columns, and their way into PCL's point types.
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/type_traits.h>

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace mrf_apps {

/// What a file says about its points. Optional columns are either empty or as long as `positions`.
struct PointTable {
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Vector3f> normals;
  std::vector<std::array<std::uint8_t, 3>> colours;
  std::map<std::string, std::vector<float>> scalars; ///< every other column, by its name in the file
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

/// Copies the columns that PointNT has.
/// \param offset is subtracted from the positions
/// \param confidences empty, or a column that goes to the `curvature` field: the type has no other spare float
template <typename PointNT>
typename pcl::PointCloud<PointNT>::Ptr toCloud(const PointTable& table, const Eigen::Vector3d& offset,
                                               const std::vector<float>& confidences)
{
  auto cloud = pcl::make_shared<pcl::PointCloud<PointNT>>();
  cloud->resize(table.size());
  cloud->is_dense = false;
  const std::vector<float>* intensities = table.hasIntensity() ? &table.scalars.at("intensity") : nullptr;
  for (std::size_t i = 0; i < table.size(); ++i) {
    PointNT& point = (*cloud)[i];
    point.getVector3fMap() = (table.positions[i] - offset).template cast<float>();
    if constexpr (pcl::traits::has_normal<PointNT>::value)
      if (!table.normals.empty())
        point.getNormalVector3fMap() = table.normals[i];
    if constexpr (pcl::traits::has_curvature<PointNT>::value)
      if (!confidences.empty())
        point.curvature = confidences[i];
    if constexpr (pcl::traits::has_color<PointNT>::value)
      if (!table.colours.empty()) {
        point.r = table.colours[i][0];
        point.g = table.colours[i][1];
        point.b = table.colours[i][2];
      }
    if constexpr (pcl::traits::has_intensity<PointNT>::value)
      if (intensities != nullptr)
        point.intensity = (*intensities)[i];
  }
  return cloud;
}

} // namespace mrf_apps
