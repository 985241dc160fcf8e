// SPDX-License-Identifier: BSD-3-Clause
// Point types of users: what they have to include, and that they work like PCL's own.
#include "support/shapes.h"

#include <pcl/surface/impl/mrf_reconstruction.hpp>

#include <pcl/point_types.h>

#include <gtest/gtest.h>

#include <cmath>

namespace precompiled_nowhere {

/// Components of the reconstruction of a sphere of points of another type, by a file that has PCL's templates compiled
/// for it, as PCL_NO_PRECOMPILE asks for.
std::int64_t componentsOfASphere();

} // namespace precompiled_nowhere

/// As scanners' drivers define them: no more than the values, without the unions of PCL's types.
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

namespace {

pcl::PointCloud<Echo>::Ptr sphere()
{
  const pcl::mrf::PointSet points = shapes::sample(shapes::sphere(1), 1.2, .15);
  pcl::PointCloud<Echo>::Ptr cloud(new pcl::PointCloud<Echo>);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f p = points.positions[i] + points.offset.cast<float>(), &n = points.normals[i];
    cloud->push_back({p.x(), p.y(), p.z(), n.x(), n.y(), n.z(), 1, 0x102030, .25f});
  }
  return cloud;
}

} // namespace

TEST(CustomPoints, WorkThroughBothOverloads)
{
  pcl::MRFReconstruction<Echo> mrf;
  mrf.setInputCloud(sphere());
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

TEST(CustomPoints, WorkWithASearchObject)
{
  pcl::MRFReconstruction<Echo> mrf;
  mrf.setInputCloud(sphere());
  mrf.setSearchMethod(pcl::search::KdTree<Echo>::Ptr(new pcl::search::KdTree<Echo>));
  pcl::PolygonMesh mesh;
  mrf.reconstruct(mesh);
  EXPECT_EQ(mrf.getReport().status, pcl::mrf::Status::ok) << mrf.getReport().message;
}

TEST(CustomPoints, NeedNoMoreThanPclNoPrecompile)
{
  EXPECT_EQ(precompiled_nowhere::componentsOfASphere(), 1);
}
