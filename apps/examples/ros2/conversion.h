// SPDX-License-Identifier: BSD-3-Clause
/// Reconstructs a mesh message of ROS 2 from a cloud message; needs no running node.
#pragma once

#include <pcl/surface/mrf_reconstruction.h>

#include <pcl/conversions.h>
#include <pcl/point_types.h>
#include <pcl_conversions/pcl_conversions.h>
#include <sensor_msgs/msg/point_cloud2.hpp>
#include <shape_msgs/msg/mesh.hpp>
#include <visualization_msgs/msg/marker.hpp>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace mrf_ros {

struct Request {
  pcl::mrf::Options options;
  std::vector<Eigen::Vector3d> sensors; ///< in the cloud's frame; empty: not known
  pcl::mrf::ProgressCallback progress;  ///< returns false to cancel
};

struct Surface {
  pcl::mrf::Report report;                ///< the rest is valid only if its status is ok
  shape_msgs::msg::Mesh mesh;             ///< has no header: its frame is the cloud's
  visualization_msgs::msg::Marker marker; ///< the same triangles, with the cloud's header and the vertices' colors
};

template <typename Point>
Surface reconstructAs(const pcl::PCLPointCloud2& message, const Request& request)
{
  const typename pcl::PointCloud<Point>::Ptr cloud(new pcl::PointCloud<Point>);
  pcl::fromPCLPointCloud2(message, *cloud);
  pcl::MRFReconstruction<Point> mrf; // throws nothing
  mrf.setInputCloud(cloud);
  mrf.setOptions(request.options);
  mrf.setSensorPositions(request.sensors);
  mrf.setProgressCallback(request.progress);
  pcl::PointCloud<Point> vertices;
  std::vector<pcl::Vertices> triangles;
  mrf.reconstruct(vertices, triangles);

  Surface surface;
  surface.report = mrf.getReport();
  for (const Point& vertex : vertices) {
    surface.mesh.vertices.emplace_back();
    surface.mesh.vertices.back().x = vertex.x;
    surface.mesh.vertices.back().y = vertex.y;
    surface.mesh.vertices.back().z = vertex.z;
  }
  for (const pcl::Vertices& triangle : triangles) {
    surface.mesh.triangles.emplace_back();
    for (int corner = 0; corner < 3; ++corner) {
      const auto v = static_cast<std::uint32_t>(triangle.vertices[corner]);
      surface.mesh.triangles.back().vertex_indices[corner] = v;
      surface.marker.points.push_back(surface.mesh.vertices[v]);
      if constexpr (pcl::traits::has_color<Point>::value) {
        surface.marker.colors.emplace_back();
        surface.marker.colors.back().r = vertices[v].r / 255.F;
        surface.marker.colors.back().g = vertices[v].g / 255.F;
        surface.marker.colors.back().b = vertices[v].b / 255.F;
        surface.marker.colors.back().a = 1;
      }
    }
  }
  return surface;
}

/// Colors and normals of the cloud are used if it has them.
inline Surface reconstruct(const sensor_msgs::msg::PointCloud2& message, const Request& request)
{
  pcl::PCLPointCloud2 cloud;
  pcl_conversions::toPCL(message, cloud);
  const auto has = [&cloud](const std::string& name) {
    return std::any_of(cloud.fields.begin(), cloud.fields.end(), [&](const auto& field) { return field.name == name; });
  };
  const auto colors = request.options.colors;
  const bool isColored =
      colors == pcl::mrf::ColorMode::input ? has("rgb") || has("rgba") : colors != pcl::mrf::ColorMode::none;
  const bool hasNormals = has("normal_x");
  Surface surface = isColored && hasNormals ? reconstructAs<pcl::PointXYZRGBNormal>(cloud, request)
                    : isColored             ? reconstructAs<pcl::PointXYZRGB>(cloud, request)
                    : hasNormals            ? reconstructAs<pcl::PointNormal>(cloud, request)
                                            : reconstructAs<pcl::PointXYZ>(cloud, request);
  surface.marker.header = message.header;
  surface.marker.ns = "mrf";
  surface.marker.type = visualization_msgs::msg::Marker::TRIANGLE_LIST;
  surface.marker.pose.orientation.w = 1;
  surface.marker.scale.x = surface.marker.scale.y = surface.marker.scale.z = 1;
  surface.marker.color.r = surface.marker.color.g = surface.marker.color.b = .8F;
  surface.marker.color.a = 1;
  return surface;
}

} // namespace mrf_ros
