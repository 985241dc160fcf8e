// SPDX-License-Identifier: BSD-3-Clause
// Input that cannot be reconstructed, or only in part: each case fails clearly or counts what it drops.
#include "support/contract.h"

#include <cmath>
#include <limits>
#include <random>

using namespace contract;
using conversion::sameBytes;
using pcl::mrf::Status;

namespace {

template <typename PointT>
std::string expectInvalidCloud(const typename pcl::PointCloud<PointT>::Ptr& cloud)
{
  pcl::MRFReconstruction<PointT> mrf;
  mrf.setInputCloud(cloud);
  return expectFailure(mrf, Status::invalidInput);
}

} // namespace

TEST(BadInput, CloudsWithoutASurface)
{
  Mrf mrf;
  expectFailure(mrf, Status::invalidInput);
  expectInvalidCloud<pcl::PointNormal>(Cloud::Ptr());
  expectInvalidCloud<pcl::PointNormal>(Cloud::Ptr(new Cloud));
  for (const std::size_t count : {1, 2, 3}) {
    Cloud::Ptr cloud = sphereCloud();
    cloud->resize(count);
    EXPECT_NE(expectInvalidCloud<pcl::PointNormal>(cloud).find(std::to_string(count)), std::string::npos);
    const auto positions = conversion::make<pcl::PointXYZ>(sphere());
    positions->resize(count);
    expectInvalidCloud<pcl::PointXYZ>(positions);
  }
  expectInvalidCloud<pcl::PointNormal>(Cloud::Ptr(new Cloud(50, 1, sphereCloud()->front())));
  expectInvalidCloud<pcl::PointXYZ>(
      pcl::PointCloud<pcl::PointXYZ>::Ptr(new pcl::PointCloud<pcl::PointXYZ>(50, 1, pcl::PointXYZ(1, 2, 3))));
  pcl::PointCloud<pcl::PointXYZ>::Ptr line(new pcl::PointCloud<pcl::PointXYZ>);
  for (int i = 0; i < 100; ++i)
    line->push_back(pcl::PointXYZ(.01f * static_cast<float>(i), .02f * static_cast<float>(i), 0));
  // No plane fits a line in one way only: there are no normals to be had.
  expectInvalidCloud<pcl::PointXYZ>(line);
  Cloud::Ptr cloud = sphereCloud();
  for (pcl::PointNormal& point : *cloud)
    point.y = std::numeric_limits<float>::quiet_NaN();
  cloud->is_dense = false;
  expectInvalidCloud<pcl::PointNormal>(cloud);
}

TEST(BadInput, WhatIsNoSurfaceIsNamed)
{
  const auto warningOf = [](float x, float y, float z) {
    pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(0, 1);
    while (cloud->size() < 8000) {
      const float u = uniform(random), v = uniform(random);
      if (u + v < 1) // a triangle, whose box has its middle elsewhere
        cloud->push_back(pcl::PointXYZ(11 + x * u, 48 + y * v, z * uniform(random) + x * u));
    }
    pcl::MRFReconstruction<pcl::PointXYZ> mrf;
    mrf.setInputCloud(cloud);
    mrf.setQuality(pcl::mrf::Quality::draft);
    pcl::PolygonMesh mesh;
    mrf.reconstruct(mesh);
    return mrf.getReport().warnings.empty() ? std::string() : mrf.getReport().warnings.front();
  };
  EXPECT_NE(warningOf(1, 1, 1).find("fill a volume"), std::string::npos);
  EXPECT_NE(warningOf(.01f, .01f, 60).find("project them to meters"), std::string::npos);
  EXPECT_NE(warningOf(1, 1, 0).find("in one plane"), std::string::npos);
}

TEST(BadInput, UnusablePointsAreCountedAndDropped)
{
  Cloud::Ptr cloud = sphereCloud();
  Mrf mrf;
  mrf.setInputCloud(cloud);
  const pcl::mrf::TriangleMesh clean = run(mrf);

  Cloud::Ptr dirty(new Cloud(*cloud));
  const std::size_t count = cloud->size();
  for (std::size_t i = 0; i < 40; ++i)
    dirty->push_back((*cloud)[i]);
  for (int i = 0; i < 3; ++i)
    dirty->push_back(cloud->front());
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    pcl::PointNormal point = cloud->front();
    point.z = bad;
    dirty->push_back(point);
    point = cloud->front();
    point.x += .01f;
    point.normal_x = bad;
    dirty->push_back(point);
  }
  pcl::PointNormal withoutNormal = cloud->front();
  withoutNormal.x += .02f;
  withoutNormal.getNormalVector3fMap().setZero();
  dirty->push_back(withoutNormal);
  dirty->is_dense = false;

  mrf.setInputCloud(dirty);
  mrf.setNormalSource(pcl::mrf::NormalSource::use);
  const pcl::mrf::TriangleMesh mesh = run(mrf);
  const pcl::mrf::PointCounts& counts = mrf.getReport().points;
  EXPECT_EQ(counts.input, static_cast<std::int64_t>(dirty->size()));
  EXPECT_EQ(counts.duplicates, 43);
  EXPECT_EQ(counts.notFinite, 2);
  EXPECT_EQ(counts.zeroNormals, 3);
  EXPECT_EQ(counts.used, static_cast<std::int64_t>(count));
  EXPECT_EQ(counts.used + counts.duplicates + counts.notFinite + counts.zeroNormals + counts.zeroConfidence +
                counts.outliersByStatistics + counts.noiseByPlaneFit + counts.smallComponents,
            counts.input);
  EXPECT_TRUE(sameBytes(mesh, clean)) << "what is left are the same points in the same order";
}

TEST(BadInput, NormalsThatAreMissingAreEstimatedAndTurned)
{
  for (const float nothing : {0.f, std::numeric_limits<float>::quiet_NaN()}) {
    const Cloud::Ptr cloud = sphereCloud();
    for (std::size_t n = 0; n < cloud->size(); n += 3)
      (*cloud)[n].getNormalVector3fMap().setConstant(nothing);
    const auto missing = static_cast<std::int64_t>((cloud->size() + 2) / 3);
    Mrf mrf;
    mrf.setInputCloud(cloud);
    run(mrf);
    EXPECT_EQ(mrf.getReport().normalsFilled, missing);
    EXPECT_EQ(mrf.getReport().points.used, static_cast<std::int64_t>(cloud->size()));
    ASSERT_EQ(mrf.getReport().warnings.size(), 1u);
    EXPECT_NE(mrf.getReport().warnings[0].find(std::to_string(missing) + " of "), std::string::npos);
    EXPECT_NEAR(mrf.getReport().mesh.volume, 4. / 3 * M_PI, .1);
    mrf.setNormalSource(pcl::mrf::NormalSource::use);
    run(mrf);
    EXPECT_EQ(mrf.getReport().normalsFilled, 0);
    EXPECT_EQ(mrf.getReport().points.zeroNormals, missing);
  }
}

TEST(BadInput, NormalsOfRandomSignAreTurned)
{
  const Cloud::Ptr cloud = sphereCloud();
  for (std::size_t n = 0; n < cloud->size(); n += 2)
    (*cloud)[n].getNormalVector3fMap() *= -1;
  Mrf mrf;
  mrf.setInputCloud(cloud);
  run(mrf);
  EXPECT_TRUE(mrf.getReport().signsOpposed);
  EXPECT_FALSE(mrf.getReport().normalsEstimated) << "the axes are the cloud's";
  ASSERT_EQ(mrf.getReport().warnings.size(), 1u);
  EXPECT_NE(mrf.getReport().warnings[0].find("setNormalSource(use)"), std::string::npos) << mrf.getReport().warnings[0];
  EXPECT_NEAR(mrf.getReport().mesh.volume, 4. / 3 * M_PI, .1);
  mrf.setNormalSource(pcl::mrf::NormalSource::use);
  mrf.reconstruct(*pcl::make_shared<pcl::PolygonMesh>());
  EXPECT_FALSE(mrf.getReport().signsOpposed) << "as they were asked for";
  EXPECT_EQ(mrf.getReport().vote, pcl::mrf::OrientationVote::none);
}

TEST(BadInput, NormalsThatLookIntoWhatThePointsEncloseAreTurned)
{
  const auto volumeOf = [](const Eigen::Vector3f& middle, const auto& sideOf, std::size_t warnings) {
    const Cloud::Ptr cloud = sphereCloud();
    for (pcl::PointNormal& point : *cloud) {
      point.getVector3fMap() += middle;
      point.getNormalVector3fMap() *= sideOf(point);
    }
    Mrf mrf;
    mrf.setInputCloud(cloud);
    run(mrf);
    EXPECT_EQ(mrf.getReport().signsOpposed, warnings > 0);
    EXPECT_EQ(mrf.getReport().warnings.size(), warnings);
    return mrf.getReport().mesh.volume;
  };
  const auto inward = [](const pcl::PointNormal&) { return -1.f; };
  const auto toOrigin = [](const pcl::PointNormal& point) {
    return point.getNormalVector3fMap().dot(point.getVector3fMap()) < 0 ? 1.f : -1.f;
  };
  const double ball = 4. / 3 * M_PI;
  EXPECT_NEAR(volumeOf({3, 0, 0}, inward, 1), ball, .1);
  EXPECT_NEAR(volumeOf({3, 0, 0}, toOrigin, 1), ball, .1) << "the viewpoint that PCL's NormalEstimation supposes";
  EXPECT_NEAR(volumeOf({0, 0, 0}, inward, 0), -ball, .1) << "a room, seen whole from within";
}

TEST(BadInput, NormalsThatAreAllZeroAreEstimated)
{
  for (const float nothing : {0.f, std::numeric_limits<float>::quiet_NaN()}) {
    const Cloud::Ptr cloud = sphereCloud();
    for (pcl::PointNormal& point : *cloud)
      point.getNormalVector3fMap().setConstant(nothing);
    Mrf mrf;
    mrf.setInputCloud(cloud);
    const pcl::mrf::TriangleMesh mesh = run(mrf);
    EXPECT_TRUE(mrf.getReport().normalsEstimated);
    EXPECT_EQ(mrf.getReport().points.zeroNormals, 0);
    ASSERT_EQ(mrf.getReport().warnings.size(), 1u);
    EXPECT_NE(mrf.getReport().warnings[0].find("all normals"), std::string::npos);
    // What a cloud gives whose type has no room for normals.
    On<pcl::PointXYZ> bare;
    EXPECT_TRUE(sameBytes(mesh, run(bare)));
    EXPECT_TRUE(bare.getReport().warnings.empty());

    mrf.setNormalSource(pcl::mrf::NormalSource::estimate);
    EXPECT_TRUE(sameBytes(run(mrf), mesh));
    EXPECT_TRUE(mrf.getReport().warnings.empty()) << "nobody asked for them";
    mrf.setNormalSource(pcl::mrf::NormalSource::reference);
    EXPECT_TRUE(sameBytes(run(mrf), mesh)) << "there is nothing to refer to";
    mrf.setNormalSource(pcl::mrf::NormalSource::use);
    EXPECT_NE(expectFailure(mrf, Status::invalidInput).find("setNormalSource"), std::string::npos);
  }
}

TEST(BadInput, LongNormalsAreDirectionsAsWell)
{
  const Cloud::Ptr cloud = sphereCloud();
  Mrf mrf;
  mrf.setInputCloud(cloud);
  const pcl::mrf::TriangleMesh expected = run(mrf);
  for (pcl::PointNormal& point : *cloud)
    point.getNormalVector3fMap() *= 0x1p100f; // its square is infinite
  EXPECT_TRUE(sameBytes(run(mrf), expected));
}

TEST(BadInput, IndicesOutsideTheCloudOrNone)
{
  OnSphere mrf;
  for (const int index : {-1, 1000000}) {
    mrf.setIndices(pcl::IndicesPtr(new pcl::Indices{0, 1, index, 2, 3}));
    EXPECT_NE(expectFailure(mrf, Status::invalidInput).find(std::to_string(index)), std::string::npos);
  }
  mrf.setIndices(pcl::IndicesPtr(new pcl::Indices));
  expectFailure(mrf, Status::invalidInput);
}

TEST(BadInput, SensorsAndViewsThatDoNotFit)
{
  OnSphere mrf;
  mrf.setSensorPositions({Eigen::Vector3d(0, 0, 5)}, {0, 0, 0});
  EXPECT_NE(expectFailure(mrf, Status::invalidInput).find("3"), std::string::npos) << "3 views";
  std::vector<std::int32_t> views(sphere().size(), 0);
  for (const std::int32_t view : {1, -1}) {
    views.back() = view;
    mrf.setSensorPositions({Eigen::Vector3d(0, 0, 5)}, views);
    expectFailure(mrf, Status::invalidInput);
  }
}

TEST(BadInput, FieldsThatAreMissingAndNoiseThatIsNone)
{
  OnSphere mrf;
  mrf.setConfidenceField("trust");
  EXPECT_NE(expectFailure(mrf, Status::invalidOption).find("trust"), std::string::npos);
  mrf.setConfidenceField("");
  mrf.setNoiseField("trust");
  EXPECT_NE(expectFailure(mrf, Status::invalidOption).find("setNoiseField 'trust'"), std::string::npos);
  mrf.setNoiseField("curvature"); // 0 everywhere
  EXPECT_NE(expectFailure(mrf, Status::invalidInput).find("deviation of 0"), std::string::npos);
  mrf.setNoiseField("");
  mrf.setNoiseModel("kinect");
  EXPECT_NE(expectFailure(mrf, Status::invalidOption).find("setSensorPosition"), std::string::npos)
      << "nobody knows the range";
  mrf.setNoiseModel("kinetic");
  EXPECT_NE(expectFailure(mrf, Status::invalidOption).find("kinetic"), std::string::npos);
  // Said twice.
  const Cloud::Ptr noisy = sphereCloud();
  for (pcl::PointNormal& point : *noisy)
    point.curvature = .01f;
  mrf.setInputCloud(noisy);
  mrf.setNoiseField("curvature");
  mrf.setNoiseModel("constant:.01");
  EXPECT_NE(expectFailure(mrf, Status::invalidOption).find("constant:.01"), std::string::npos);
  mrf.setNoiseModel("automatic");
  mrf.setNoise(.5f);
  EXPECT_NE(expectFailure(mrf, Status::invalidOption).find("0.5"), std::string::npos);
}

TEST(Coplanar, PatchGivesThePatch)
{
  // With normals, and without: then its side is arbitrary, its shape is not.
  const pcl::mrf::PointSet points = patch();
  On<pcl::PointNormal> withNormals(points);
  On<pcl::PointXYZ> estimated(points);
  const pcl::mrf::TriangleMesh first = run(withNormals), second = run(estimated);
  for (const pcl::mrf::TriangleMesh& mesh : {first, second}) {
    const pcl::mrf::MeshStatistics statistics = pcl::mrf::measure(mesh);
    EXPECT_TRUE(statistics.manifold());
    EXPECT_EQ(statistics.components, 1);
    EXPECT_EQ(statistics.boundaryLoops, 1);
    // Support reaches dEmax = 3 l̄ = 0.3 beyond the points, and triangles with one supported vertex are kept: one edge
    // (h = 0.2) more. It may not end before the points do.
    EXPECT_GT(statistics.area, 2 * 2);
    EXPECT_LT(statistics.area, 3 * 3);
    for (const Eigen::Vector3f& vertex : mesh.vertices)
      EXPECT_LT(std::abs(vertex.z()), .01f) << "a twentieth of a voxel: the data is exact";
  }
  for (const Eigen::Vector3f& normal : first.normals)
    EXPECT_GT(normal.z(), .99f);
}
