/// \file
/// \brief Between the plain arrays of the test shapes and PCL's clouds and meshes.
#pragma once

#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <pcl/conversions.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/PolygonMesh.h>
#include <pcl/type_traits.h>

namespace clouds {

/// A cloud of the points, with their normals where the type has room for them.
template <typename PointT>
typename pcl::PointCloud<PointT>::Ptr make(const pcl::mrf::PointSet& points)
{
  typename pcl::PointCloud<PointT>::Ptr cloud(new pcl::PointCloud<PointT>);
  for (std::size_t i = 0; i < points.size(); ++i) {
    PointT point;
    point.getVector3fMap() = (points.positions[i].template cast<double>() + points.offset).template cast<float>();
    if constexpr (pcl::traits::has_normal<PointT>::value)
      point.getNormalVector3fMap() = points.normals[i];
    cloud->push_back(point);
  }
  return cloud;
}

inline std::vector<pcl::mrf::Triangle> triangles(const std::vector<pcl::Vertices>& polygons)
{
  std::vector<pcl::mrf::Triangle> result;
  for (const pcl::Vertices& polygon : polygons)
    result.push_back({polygon.vertices.at(0), polygon.vertices.at(1), polygon.vertices.at(2)});
  return result;
}

inline bool hasField(const pcl::PolygonMesh& mesh, const std::string& name)
{
  for (const pcl::PCLPointField& field : mesh.cloud.fields)
    if (field.name == name)
      return true;
  return false;
}

/// Positions, normals and confidences of a reconstruction's output.
inline pcl::mrf::TriangleMesh plain(const pcl::PolygonMesh& mesh)
{
  pcl::mrf::TriangleMesh result;
  result.triangles = triangles(mesh.polygons);
  if (mesh.cloud.width == 0)
    return result;
  pcl::PointCloud<pcl::PointNormal> points;
  pcl::fromPCLPointCloud2(mesh.cloud, points);
  for (const pcl::PointNormal& point : points) {
    result.vertices.push_back(point.getVector3fMap());
    result.normals.push_back(point.getNormalVector3fMap());
  }
  std::size_t offset = 0;
  for (const pcl::PCLPointField& field : mesh.cloud.fields)
    if (field.name == "confidence")
      offset = field.offset;
  for (std::size_t v = 0; v < points.size(); ++v) {
    float confidence;
    std::memcpy(&confidence, mesh.cloud.data.data() + v * mesh.cloud.point_step + offset, sizeof(float));
    result.confidences.push_back(confidence);
  }
  return result;
}

} // namespace clouds
