// SPDX-License-Identifier: BSD-3-Clause
/// Shared by the tests of the class: small clouds, and checks of runs that fail.
#pragma once

#include "conversion.h"
#include "shapes.h"

#include <pcl/surface/mrf_reconstruction.h>

#include <pcl/console/print.h>
#include <pcl/search/kdtree.h>

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace contract {

using Mrf = pcl::MRFReconstruction<pcl::PointNormal>;
using Cloud = pcl::PointCloud<pcl::PointNormal>;

constexpr double spacing = .15; // about 500 points on the unit sphere

inline const pcl::mrf::PointSet& sphere()
{
  static const pcl::mrf::PointSet points = shapes::sample(shapes::sphere(1), 1.2, spacing);
  return points;
}

inline Cloud::Ptr sphereCloud()
{
  return conversion::make<pcl::PointNormal>(sphere());
}

/// A square patch of the plane z = 0 with about 400 points.
inline pcl::mrf::PointSet patch()
{
  return shapes::filter(shapes::sample(shapes::plane(Eigen::Vector3d::UnitZ()), 1.2, .1),
                        [](const Eigen::Vector3f& p) { return p.cwiseAbs().maxCoeff() < 1; });
}

/// Outputs that are not empty, so that a test sees whether they were cleared.
template <typename PointT>
struct Outputs {
  pcl::PolygonMesh mesh;
  pcl::PointCloud<PointT> points;
  std::vector<pcl::Vertices> polygons;

  Outputs()
  {
    polygons.resize(3);
    points.resize(5);
    mesh.polygons = polygons;
    pcl::toPCLPointCloud2(points, mesh.cloud);
  }
};

inline void expectCleared(const pcl::PolygonMesh& mesh)
{
  EXPECT_TRUE(mesh.polygons.empty());
  EXPECT_TRUE(mesh.cloud.data.empty());
  EXPECT_EQ(mesh.cloud.width, 0u);
}

/// Runs both overloads, which must fail, with these words in the message, and clear their outputs. \return the message
template <typename PointT>
std::string expectFailure(pcl::MRFReconstruction<PointT>& mrf, pcl::mrf::Status status, const std::string& words = {})
{
  Outputs<PointT> outputs;
  mrf.reconstruct(outputs.mesh);
  EXPECT_EQ(toString(mrf.getReport().status), std::string(toString(status))) << mrf.getReport().message;
  expectCleared(outputs.mesh);
  const std::string message = mrf.getReport().message;
  EXPECT_GT(message.size(), 10u);
  EXPECT_NE(message.find(words), std::string::npos) << "'" << words << "' is expected in: " << message;

  mrf.reconstruct(outputs.points, outputs.polygons);
  EXPECT_EQ(mrf.getReport().status, status);
  EXPECT_EQ(mrf.getReport().message, message);
  EXPECT_TRUE(outputs.points.empty());
  EXPECT_TRUE(outputs.polygons.empty());
  EXPECT_TRUE(mrf.getDistanceField().empty());
  return message;
}

/// The output of a run that must succeed.
template <typename PointT>
pcl::PolygonMesh outputOf(pcl::MRFReconstruction<PointT>& mrf)
{
  pcl::PolygonMesh mesh;
  mrf.reconstruct(mesh);
  EXPECT_EQ(mrf.getReport().status, pcl::mrf::Status::ok) << mrf.getReport().message;
  return mesh;
}

template <typename PointT>
pcl::mrf::TriangleMesh run(pcl::MRFReconstruction<PointT>& mrf)
{
  return conversion::plain(outputOf(mrf));
}

/// The class with the given points as its input.
template <typename PointT>
struct On : pcl::MRFReconstruction<PointT> {
  explicit On(const pcl::mrf::PointSet& points = sphere()) : On(conversion::make<PointT>(points)) {}
  explicit On(const typename pcl::PointCloud<PointT>::Ptr& cloud) { this->setInputCloud(cloud); }
};
using OnSphere = On<pcl::PointNormal>;

/// One of PCL's searches, with a function that inspects or changes its answers.
struct ChangedSearch : pcl::search::KdTree<pcl::PointNormal> {
  using Base = pcl::search::KdTree<pcl::PointNormal>;
  using Change = std::function<int(int found, pcl::Indices& indices, std::vector<float>& distances)>;
  Change change;
  using Base::nearestKSearch;
  using Base::radiusSearch;

  explicit ChangedSearch(Change with) : change(std::move(with)) {}

  int nearestKSearch(const pcl::PointNormal& point, int k, pcl::Indices& indices,
                     std::vector<float>& distances) const override
  {
    return change(Base::nearestKSearch(point, k, indices, distances), indices, distances);
  }
  int radiusSearch(const pcl::PointNormal& point, double radius, pcl::Indices& indices, std::vector<float>& distances,
                   unsigned int limit) const override
  {
    return change(Base::radiusSearch(point, radius, indices, distances, limit), indices, distances);
  }
};

/// Turns off PCL's messages: the errors that these tests provoke would hide those of the tests.
class Quiet : public ::testing::Environment {
public:
  void SetUp() override { pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS); }
};
inline const auto* const quiet = ::testing::AddGlobalTestEnvironment(new Quiet);

} // namespace contract
