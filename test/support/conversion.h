// SPDX-License-Identifier: BSD-3-Clause
/// Converts between the plain arrays of the test shapes and PCL's clouds and meshes.
#pragma once

#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <pcl/conversions.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/PolygonMesh.h>
#include <pcl/type_traits.h>

#include <cstring>
#include <string>
#include <vector>

namespace conversion {

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

/// The values of a float field, one per point; empty if there is no such field.
inline std::vector<float> values(const pcl::PCLPointCloud2& cloud, const std::string& name)
{
  std::vector<float> result;
  for (const pcl::PCLPointField& field : cloud.fields)
    if (field.name == name && field.datatype == pcl::PCLPointField::FLOAT32)
      for (std::size_t v = 0; v < cloud.width; ++v) {
        float value;
        std::memcpy(&value, cloud.data.data() + v * cloud.point_step + field.offset, sizeof(float));
        result.push_back(value);
      }
  return result;
}

inline bool hasField(const pcl::PolygonMesh& mesh, const std::string& name)
{
  return !values(mesh.cloud, name).empty();
}

/// Positions, normals and confidences of a reconstruction's output.
inline pcl::mrf::TriangleMesh plain(const pcl::PolygonMesh& mesh)
{
  const auto vectors = [&](const char* x, const char* y, const char* z) {
    const std::vector<float> xs = values(mesh.cloud, x), ys = values(mesh.cloud, y), zs = values(mesh.cloud, z);
    std::vector<Eigen::Vector3f> result;
    for (std::size_t v = 0; v < xs.size(); ++v)
      result.emplace_back(xs[v], ys.at(v), zs.at(v));
    return result;
  };
  pcl::mrf::TriangleMesh result;
  result.triangles = triangles(mesh.polygons);
  result.vertices = vectors("x", "y", "z");
  result.normals = vectors("normal_x", "normal_y", "normal_z");
  result.confidences = values(mesh.cloud, "confidence");
  return result;
}

inline bool sameBytes(const pcl::mrf::TriangleMesh& a, const pcl::mrf::TriangleMesh& b)
{
  return a.vertices == b.vertices && a.triangles == b.triangles && a.normals == b.normals &&
         a.confidences == b.confidences;
}

} // namespace conversion
