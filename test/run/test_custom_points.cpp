// SPDX-License-Identifier: BSD-3-Clause
// Point types of users work like PCL's own. This test uses PCL_NO_PRECOMPILE, which makes PCL compile its templates
// where they are used; the example own_points.cpp includes the class's implementation instead and sets a search object.
#define PCL_NO_PRECOMPILE

#include "support/shapes.h"

#include <pcl/surface/mrf_reconstruction.h>

#include <pcl/point_types.h>

#include <gtest/gtest.h>

#include <cmath>

/// A point type as scanner drivers define it: only the values, without the unions of PCL's types.
struct Echo {
  float x, y, z;
  float normal_x, normal_y, normal_z;
  float confidence;
  std::uint32_t rgb;
  float intensity;
};
POINT_CLOUD_REGISTER_POINT_STRUCT(
    Echo,
    (float, x, x)(float, y, y)(float, z, z)(float, normal_x, normal_x)(float, normal_y, normal_y)(
        float, normal_z, normal_z)(float, confidence, confidence)(std::uint32_t, rgb, rgb)(float, intensity, intensity))

TEST(CustomPoints, WorkThroughBothOverloads)
{
  const pcl::mrf::PointSet sphere = shapes::sample(shapes::sphere(1), 1.2, .15);
  const pcl::PointCloud<Echo>::Ptr cloud(new pcl::PointCloud<Echo>);
  for (std::size_t i = 0; i < sphere.size(); ++i) {
    const Eigen::Vector3f &p = sphere.positions[i], &n = sphere.normals[i];
    cloud->push_back({p.x(), p.y(), p.z(), n.x(), n.y(), n.z(), 1, 0x102030, .25f});
  }
  pcl::MRFReconstruction<Echo> mrf;
  mrf.setInputCloud(cloud);
  mrf.setConfidenceField("confidence");
  pcl::PolygonMesh mesh;
  mrf.reconstruct(mesh);
  const pcl::mrf::Report report = mrf.getReport();
  ASSERT_EQ(report.status, pcl::mrf::Status::ok) << report.message;
  EXPECT_FALSE(report.normalsEstimated);
  EXPECT_TRUE(report.mesh.closed());
  // Points of spacing .15 on curvature 1: chords and tangents are off by spacing²/2 = 1 %, thrice that in the volume.
  EXPECT_NEAR(report.mesh.volume, 4 * M_PI / 3, .05 * 4 * M_PI / 3);

  pcl::PointCloud<Echo> vertices;
  pcl::fromPCLPointCloud2(mesh.cloud, vertices);
  EXPECT_EQ(vertices[0].rgb & 0xffffff, 0x102030u);
  EXPECT_FLOAT_EQ(vertices[0].intensity, .25f);

  pcl::PointCloud<Echo> points;
  std::vector<pcl::Vertices> polygons;
  mrf.reconstruct(points, polygons);
  ASSERT_EQ(points.size(), static_cast<std::size_t>(report.mesh.vertices));
  EXPECT_EQ(polygons.size(), mesh.polygons.size());
  for (const Echo& point : points) {
    const Eigen::Vector3f position(point.x, point.y, point.z), normal(point.normal_x, point.normal_y, point.normal_z);
    EXPECT_GT(normal.dot(position), .9f) << "outward";
    EXPECT_EQ(point.rgb & 0xffffff, 0x102030u);
    EXPECT_FLOAT_EQ(point.intensity, .25f) << "beside the color";
    EXPECT_GT(point.confidence, .3f);
    EXPECT_LE(point.confidence, 1);
  }
}
