// SPDX-License-Identifier: BSD-3-Clause
// Input that cannot be reconstructed, or only in part: each case fails clearly or counts what it drops.
#include "support/clouds.h"
#include "support/contract.h"

#include <pcl/common/io.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

using namespace contract;
using conversion::sameBytes;
using pcl::mrf::Status;

namespace {

template <typename PointT>
std::string expectInvalidCloud(const typename pcl::PointCloud<PointT>::Ptr& cloud)
{
  On<PointT> mrf(cloud);
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
    const std::string number = std::to_string(count);
    EXPECT_EQ(expectInvalidCloud<pcl::PointNormal>(cloud),
              "at least 4 points are needed; " + number + " of " + number + " are left");
    const auto positions = conversion::make<pcl::PointXYZ>(sphere());
    positions->resize(count);
    expectInvalidCloud<pcl::PointXYZ>(positions);
  }
  expectInvalidCloud<pcl::PointNormal>(Cloud::Ptr(new Cloud(50, 1, sphereCloud()->front())));
  expectInvalidCloud<pcl::PointXYZ>(
      pcl::PointCloud<pcl::PointXYZ>::Ptr(new pcl::PointCloud<pcl::PointXYZ>(50, 1, pcl::PointXYZ(1, 2, 3))));
  EXPECT_NE(expectInvalidCloud<pcl::PointXYZ>(
                pcl::PointCloud<pcl::PointXYZ>::Ptr(new pcl::PointCloud<pcl::PointXYZ>(50, 1, pcl::PointXYZ())))
                .find("from a file with doubles"),
            std::string::npos);
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
    On<pcl::PointXYZ> mrf(cloud);
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
  On<pcl::PointNormal> mrf(cloud);
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

TEST(BadInput, NormalsThatAreMissingOrOnTheWrongSide)
{
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto every = [](std::size_t step, float factor) {
    return [=](std::size_t n, const Eigen::Vector3f&, const Eigen::Vector3f& normal) {
      return Eigen::Vector3f((n % step == 0 ? factor : 1) * normal);
    };
  };
  const auto toOrigin = [](std::size_t, const Eigen::Vector3f& position, const Eigen::Vector3f& normal) {
    return Eigen::Vector3f(normal.dot(position) < 0 ? normal : -normal);
  };
  const auto capInward = [](std::size_t, const Eigen::Vector3f& position, const Eigen::Vector3f& normal) {
    return Eigen::Vector3f(position.x() < -.7f ? -normal : normal);
  };
  const std::int64_t third = (static_cast<std::int64_t>(sphere().size()) + 2) / 3;
  const double ball = 4. / 3 * M_PI;
  const struct {
    const char* name;
    float x; ///< of the ball's middle
    std::function<Eigen::Vector3f(std::size_t, const Eigen::Vector3f&, const Eigen::Vector3f&)> normal;
    std::int64_t filled;
    bool opposed;
    std::string words; ///< of the only warning; empty: none
    double volume;
  } cases[] = {{"a third is zero", 0, every(3, 0), third, false, std::to_string(third) + " of ", ball},
               {"a third is not finite", 0, every(3, nan), third, false, std::to_string(third) + " of ", ball},
               {"half of them look inward", 0, every(2, -1), 0, true, "setNormalSource(use)", ball},
               {"a cap of a seventh looks inward", 0, capInward, 0, true, "setNormalSource(use)", ball},
               {"all look inward", 3, every(1, -1), 0, true, "setNormalSource(use)", ball},
               {"they look at the viewpoint that PCL's NormalEstimation supposes", 3, toOrigin, 0, true, "", ball},
               {"the same viewpoint, far away", 100, toOrigin, 0, true, "", ball},
               {"a room, seen whole from within", 0, every(1, -1), 0, false, "", -ball}};
  for (const auto& given : cases) {
    SCOPED_TRACE(given.name);
    const Cloud::Ptr cloud = sphereCloud();
    for (std::size_t n = 0; n < cloud->size(); ++n) {
      pcl::PointNormal& point = (*cloud)[n];
      point.x += given.x;
      point.getNormalVector3fMap() = given.normal(n, point.getVector3fMap(), point.getNormalVector3fMap());
    }
    On<pcl::PointNormal> mrf(cloud);
    run(mrf);
    const pcl::mrf::Report& report = mrf.getReport();
    EXPECT_EQ(report.normalsFilled, given.filled);
    EXPECT_EQ(report.signsOpposed, given.opposed);
    EXPECT_FALSE(report.normalsEstimated) << "the axes are the cloud's";
    EXPECT_EQ(report.points.used, static_cast<std::int64_t>(cloud->size()));
    EXPECT_NEAR(report.mesh.volume, given.volume, .1);
    ASSERT_EQ(report.warnings.size(), given.filled > 0 || given.opposed ? 1u : 0u);
    for (const std::string& warning : report.warnings)
      EXPECT_NE(warning.find(given.words), std::string::npos) << warning;

    mrf.setNormalSource(pcl::mrf::NormalSource::use);
    mrf.reconstruct(*pcl::make_shared<pcl::PolygonMesh>());
    EXPECT_EQ(report.normalsFilled, 0);
    EXPECT_EQ(report.points.zeroNormals, given.filled);
    EXPECT_FALSE(report.signsOpposed) << "as they were asked for";
    EXPECT_EQ(report.vote, pcl::mrf::OrientationVote::none);
  }
}

TEST(BadInput, NormalsThatLookInwardAreTurnedIfSomeAreMissing)
{
  const Cloud::Ptr cloud = sphereCloud();
  for (std::size_t n = 0; n < cloud->size(); ++n)
    (*cloud)[n].getNormalVector3fMap() *= n % 10 == 0 ? 0.f : -1.f;
  On<pcl::PointNormal> mrf(cloud);
  run(mrf);
  EXPECT_TRUE(mrf.getReport().signsOpposed);
  EXPECT_NEAR(mrf.getReport().mesh.volume, 4. / 3 * M_PI, .1);
}

/// Objects whose outside is clearer from their normals than from their points.
TEST(BadInput, NormalsThatAreRightStay)
{
  const Cloud::Ptr unitBall = sphereCloud();
  const auto addBall = [&](Cloud& cloud, float x, float radius, float side) {
    for (pcl::PointNormal point : *unitBall) {
      point.getVector3fMap() = radius * point.getVector3fMap() + x * Eigen::Vector3f::UnitX();
      point.getNormalVector3fMap() *= side;
      cloud.push_back(point);
    }
  };
  const Cloud::Ptr touching(new Cloud), room(new Cloud), plate(new Cloud);
  addBall(*touching, 3, 1, 1);
  addBall(*touching, 5, 1, 1);
  addBall(*room, 3, 1, -1); // seen from within, with a ball in it
  addBall(*room, 3, .5f, 1);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 50);
  for (int n = 0; n < 5000; ++n) { // of .8 point distances
    pcl::PointNormal point(uniform(random), uniform(random), n % 2 == 0 ? .8f : 0);
    point.normal_z = n % 2 == 0 ? 1 : -1;
    plate->push_back(point);
  }
  const double ball = 4. / 3 * M_PI;
  for (const auto& [cloud, volume] : {std::pair(touching, 2 * ball), {room, -.875 * ball}, {plate, 0.}}) {
    SCOPED_TRACE(volume); // 0: it encloses none
    On<pcl::PointNormal> mrf(cloud);
    run(mrf);
    EXPECT_FALSE(mrf.getReport().signsOpposed);
    EXPECT_EQ(mrf.getReport().vote, pcl::mrf::OrientationVote::none);
    EXPECT_TRUE(mrf.getReport().warnings.empty());
    if (volume != 0) {
      EXPECT_NEAR(mrf.getReport().mesh.volume, volume, .1);
    }
  }
}

constexpr float eggVolume = 4.f / 3 * static_cast<float>(M_PI) * 2 * 1 * .8f;

/// 6000 points of an ellipsoid around the origin. \param densityOf relative, up to 1
Cloud::Ptr eggCloud(const std::function<float(const Eigen::Vector3f&)>& densityOf)
{
  const Eigen::Vector3f half(2, 1, .8f);
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> uniform(0, 1);
  const Cloud::Ptr cloud(new Cloud);
  while (cloud->size() < 6000) {
    const Eigen::Vector3f direction(Eigen::Vector3f::NullaryExpr([&] { return normal(random); }).normalized());
    const Eigen::Vector3f at = direction.cwiseProduct(half), outward = direction.cwiseQuotient(half);
    if (uniform(random) > densityOf(at) * half.minCoeff() * outward.norm()) // even for a density of 1
      continue;
    pcl::PointNormal point(at.x(), at.y(), at.z());
    point.getNormalVector3fMap() = outward.normalized();
    cloud->push_back(point);
  }
  return cloud;
}

void turnNormalsTo(const Eigen::Vector3f& viewpoint, Cloud& cloud)
{
  for (pcl::PointNormal& point : cloud)
    if (point.getNormalVector3fMap().dot(viewpoint - point.getVector3fMap()) < 0)
      point.getNormalVector3fMap() *= -1;
}

/// Normals turned to where no sensor was, and to where one may have been. The spacings tell which.
TEST(BadInput, SpacingTellsWhereASensorMayHaveBeen)
{
  const Eigen::Vector3f station(-1.5f, .2f, .1f);
  const auto even = [](const Eigen::Vector3f&) { return 1.f; };
  const auto asScanned = [&](const Eigen::Vector3f& at) { return .2f / (at - station).squaredNorm(); };
  const struct {
    const char* name;
    Cloud::Ptr cloud;
    Eigen::Vector3f viewpoint; ///< that all normals are turned to
    bool opposed;
    double volume;
  } cases[] = {{"an object around the origin", eggCloud(even), {0, 0, 0}, true, eggVolume},
               {"a room that is seen from within", eggCloud(asScanned), station, false, -eggVolume},
               {"a room, and a viewpoint outside of it", eggCloud(asScanned), {0, 1.5f, 0}, true, -eggVolume}};
  for (const auto& given : cases) {
    SCOPED_TRACE(given.name);
    turnNormalsTo(given.viewpoint, *given.cloud);
    On<pcl::PointNormal> mrf(given.cloud);
    run(mrf);
    EXPECT_EQ(mrf.getReport().signsOpposed, given.opposed);
    EXPECT_EQ(mrf.getReport().warnings.size(), given.opposed ? 1u : 0u);
    EXPECT_NEAR(mrf.getReport().mesh.volume, given.volume, .1);
  }
  // Signs that no viewpoint explains are no error of turning normals to one.
  const Cloud::Ptr ofTwoRooms = eggCloud(asScanned);
  for (pcl::PointNormal& point : *ofTwoRooms)
    if (std::abs(point.x) < 1.5f)
      point.getNormalVector3fMap() *= -1;
  On<pcl::PointNormal> mrf(ofTwoRooms);
  run(mrf);
  EXPECT_FALSE(mrf.getReport().signsOpposed);
}

/// Without normals, points that cannot be seen from outside tell that uneven ones were seen from within.
TEST(BadInput, HiddenPointsTellARoom)
{
  const Eigen::Vector3f station(-1.5f, .2f, .1f), amid(.5f, 0, 0);
  constexpr float objectRadius = .3f, objectVolume = 4 * static_cast<float>(M_PI) / 3 * .027f;
  const Cloud::Ptr egg = eggCloud([&](const Eigen::Vector3f& at) { return .2f / (at - station).squaredNorm(); });
  const Cloud::Ptr ball = sphereCloud();
  pcl::PointCloud<pcl::PointXYZ> room;
  pcl::copyPointCloud(*egg, room);
  for (const bool hasObject : {false, true}) {
    SCOPED_TRACE(hasObject);
    if (hasObject)
      for (const pcl::PointNormal& point : *ball) {
        const Eigen::Vector3f at = amid + objectRadius * point.getVector3fMap();
        room.push_back({at.x(), at.y(), at.z()});
      }
    On<pcl::PointXYZ> bare(room.makeShared());
    run(bare);
    EXPECT_NEAR(bare.getReport().mesh.volume, hasObject ? objectVolume - eggVolume : eggVolume, .1);
    EXPECT_TRUE(bare.getReport().orientation.sideIsGuessed);
    ASSERT_EQ(bare.getReport().warnings.size(), 1u);
    EXPECT_NE(bare.getReport().warnings[0].find(hasObject ? "the inside" : "the outside"), std::string::npos);
  }
}

/// What few rays from outside reach, as the inside of a casting, is hidden as well, but sparse.
TEST(BadInput, HiddenPointsThatAreSparseTellNoRoom)
{
  constexpr double outer = 1, inner = .6;
  pcl::mrf::PointSet hollow = shapes::sample(shapes::sphere(outer), 1.2, .04);
  clouds::append(hollow, shapes::sample(shapes::sphere(inner), 1.2, .095));
  const Cloud::Ptr cloud = conversion::make<pcl::PointNormal>(hollow);
  turnNormalsTo({2, 0, 0}, *cloud);
  On<pcl::PointNormal> mrf(cloud);
  const pcl::PointCloud<pcl::PointXYZ>::Ptr positions(new pcl::PointCloud<pcl::PointXYZ>);
  pcl::copyPointCloud(*cloud, *positions);
  On<pcl::PointXYZ> bare(positions);
  run(mrf);
  run(bare);
  constexpr double volume = 4 * M_PI / 3 * (outer * outer * outer - inner * inner * inner);
  EXPECT_TRUE(mrf.getReport().signsOpposed);
  EXPECT_NEAR(mrf.getReport().mesh.volume, volume, .1);
  EXPECT_NEAR(bare.getReport().mesh.volume, volume, .1);
}

TEST(BadInput, TerrainWhoseNormalsAreTurnedToAPointInItFacesUp)
{
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-20, 20);
  const Cloud::Ptr cloud(new Cloud);
  while (cloud->size() < 6000) {
    const float x = uniform(random), y = uniform(random);
    pcl::PointNormal point(x, y, 2 * std::sin(x / 5));
    point.getNormalVector3fMap() = Eigen::Vector3f(-.4f * std::cos(x / 5), 0, 1).normalized();
    cloud->push_back(point);
  }
  turnNormalsTo(Eigen::Vector3f::Zero(), *cloud);
  On<pcl::PointNormal> mrf(cloud);
  const pcl::mrf::TriangleMesh mesh = run(mrf);
  EXPECT_TRUE(mrf.getReport().signsOpposed);
  EXPECT_EQ(mrf.getReport().warnings.size(), 2u) << "also that the side is a guess";
  Eigen::Vector3f area = Eigen::Vector3f::Zero();
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3f& a = mesh.vertices[triangle[0]];
    area += (mesh.vertices[triangle[1]] - a).cross(mesh.vertices[triangle[2]] - a) / 2;
  }
  EXPECT_GT(area.z(), .97f * 40 * 40);
}

/// Filters that let normals point up tell nothing of walls, whose normals point up by chance.
TEST(BadInput, WallsWhoseNormalsWereTurnedUpFaceOneSide)
{
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::normal_distribution<float> noise(0, .1f);
  for (const bool isTurnedUp : {true, false}) {
    constexpr float radius = 1.5f, height = .8f;
    const Cloud::Ptr cloud(new Cloud);
    const auto add = [&](float across, float z, Eigen::Vector3f normal) {
      const float turn = 2 * static_cast<float>(M_PI) * uniform(random);
      const Eigen::AngleAxisf around(turn, Eigen::Vector3f::UnitZ());
      normal = (around * normal + Eigen::Vector3f(noise(random), noise(random), noise(random))).normalized();
      pcl::PointNormal point;
      point.getVector3fMap() = around * Eigen::Vector3f(across, 0, z);
      point.getNormalVector3fMap() = isTurnedUp && normal.z() < 0 ? Eigen::Vector3f(-normal) : normal;
      cloud->push_back(point);
    };
    for (int n = 0; n < 5000; ++n)
      add(std::sqrt(radius * radius + 33 * uniform(random)), 0, Eigen::Vector3f::UnitZ());
    for (int n = 0; n < 350; ++n)
      add(radius * std::sqrt(uniform(random)), height, Eigen::Vector3f::UnitZ());
    for (int n = 0; n < 360; ++n)
      add(radius, height * uniform(random), Eigen::Vector3f::UnitX());
    On<pcl::PointNormal> mrf(cloud);
    const pcl::mrf::TriangleMesh mesh = run(mrf);
    EXPECT_EQ(mrf.getReport().signsOpposed, isTurnedUp);
    double out = 0, in = 0;
    for (const auto& triangle : mesh.triangles) {
      const Eigen::Vector3f &a = mesh.vertices[triangle[0]], &b = mesh.vertices[triangle[1]],
                            &c = mesh.vertices[triangle[2]];
      const Eigen::Vector3f middle = (a + b + c) / 3, area = (b - a).cross(c - a) / 2;
      if (middle.z() > .2f && middle.z() < .6f)
        (area.head<2>().dot(middle.head<2>()) > 0 ? out : in) += area.norm();
    }
    EXPECT_NEAR(out, 2 * M_PI * .4 * radius, .4);
    EXPECT_LT(in, .02 * out);
  }
}

TEST(BadInput, NormalsThatAreAllZeroAreEstimated)
{
  for (const float nothing : {0.f, std::numeric_limits<float>::quiet_NaN()}) {
    const Cloud::Ptr cloud = sphereCloud();
    for (pcl::PointNormal& point : *cloud)
      point.getNormalVector3fMap().setConstant(nothing);
    On<pcl::PointNormal> mrf(cloud);
    const pcl::mrf::TriangleMesh mesh = run(mrf);
    EXPECT_TRUE(mrf.getReport().normalsEstimated);
    EXPECT_EQ(mrf.getReport().points.zeroNormals, 0);
    ASSERT_EQ(mrf.getReport().warnings.size(), 1u);
    EXPECT_NE(mrf.getReport().warnings[0].find("the cloud has no normals"), std::string::npos);
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
    expectFailure(mrf, Status::invalidInput, "setNormalSource");
  }
}

TEST(BadInput, NothingIsAskedForThatWasGiven)
{
  On<pcl::PointXYZ> seen;
  seen.setSensorPosition({0, 0, 5}); // which sees two fifths of a ball
  run(seen);
  EXPECT_NE(testing::PrintToString(seen.getReport().warnings).find("cannot have seen all points"), std::string::npos);
  seen.setSensorPositions({{0, 0, 5}, {0, .1, 5}});
  run(seen);
  EXPECT_NE(testing::PrintToString(seen.getReport().warnings).find("saw each point (setSensorPositions)"),
            std::string::npos);
  On<pcl::PointNormal> estimating(conversion::make<pcl::PointNormal>(patch()));
  estimating.setNormalSource(pcl::mrf::NormalSource::estimate);
  run(estimating);
  EXPECT_NE(testing::PrintToString(estimating.getReport().warnings).find("good ones (setNormalSource(auto))"),
            std::string::npos);
}

TEST(BadInput, LongNormalsAreDirectionsAsWell)
{
  const Cloud::Ptr cloud = sphereCloud();
  On<pcl::PointNormal> mrf(cloud);
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
    expectFailure(mrf, Status::invalidInput, std::to_string(index));
  }
  mrf.setIndices(pcl::IndicesPtr(new pcl::Indices));
  expectFailure(mrf, Status::invalidInput);
}

TEST(BadInput, SensorsAndViewsThatDoNotFit)
{
  OnSphere mrf;
  mrf.setSensorPositions({Eigen::Vector3d(0, 0, 5)}, {0, 0, 0});
  expectFailure(mrf, Status::invalidInput, "3 views");
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
  expectFailure(mrf, Status::invalidOption, "setConfidenceField 'trust'");
  mrf.setConfidenceField("");
  mrf.setNoiseField("trust");
  expectFailure(mrf, Status::invalidOption, "setNoiseField 'trust'");
  mrf.setNoiseField("curvature"); // 0 everywhere
  expectFailure(mrf, Status::invalidInput, "deviation of 0");
  mrf.setNoiseField("");
  mrf.setNoiseModel("kinect");
  expectFailure(mrf, Status::invalidOption, "setSensorPosition"); // nobody knows the range
  mrf.setNoiseModel("kinetic");
  expectFailure(mrf, Status::invalidOption, "kinetic");
  // Said twice.
  const Cloud::Ptr noisy = sphereCloud();
  for (pcl::PointNormal& point : *noisy)
    point.curvature = .01f;
  mrf.setInputCloud(noisy);
  mrf.setNoiseField("curvature");
  mrf.setNoiseModel("constant:.01");
  expectFailure(mrf, Status::invalidOption, "constant:.01");
  mrf.setNoiseModel("automatic");
  mrf.setNoise(.5f);
  expectFailure(mrf, Status::invalidOption, "0.5");
}
