// SPDX-License-Identifier: BSD-3-Clause
// The contract of pcl::MRFReconstruction that PCL users rely on.
#include "support/contract.h"

#include <pcl/search/organized.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <thread>

using namespace contract;
using conversion::sameBytes;
using pcl::mrf::Status;

namespace {

Cloud::Ptr torusCloud()
{
  return conversion::make<pcl::PointNormal>(shapes::sample(shapes::torus(1, .4), 1.6, spacing));
}

/// The mesh of a cloud by a new object with default settings; computed once for all tests.
const pcl::mrf::TriangleMesh& meshOf(Cloud::Ptr (*cloud)())
{
  static std::map<Cloud::Ptr (*)(), pcl::mrf::TriangleMesh> meshes;
  const auto [entry, isNew] = meshes.try_emplace(cloud);
  if (isNew) {
    On<pcl::PointNormal> mrf(cloud());
    entry->second = run(mrf);
  }
  return entry->second;
}

} // namespace

template <typename PointT>
class EveryPointType : public ::testing::Test {};
#ifdef PCL_ONLY_CORE_POINT_TYPES
using PointTypes = ::testing::Types<pcl::PointXYZ, pcl::PointNormal, pcl::PointXYZRGBNormal>;
#else
using PointTypes =
    ::testing::Types<pcl::PointXYZ, pcl::PointXYZI, pcl::PointXYZL, pcl::PointXYZRGBA, pcl::PointXYZRGB,
                     pcl::PointXYZRGBL, pcl::PointXYZLAB, pcl::PointXYZHSV, pcl::InterestPoint, pcl::PointNormal,
                     pcl::PointXYZRGBNormal, pcl::PointXYZINormal, pcl::PointXYZLNormal, pcl::PointWithRange,
                     pcl::PointWithViewpoint, pcl::PointWithScale, pcl::PointSurfel, pcl::PointDEM>;
#endif
TYPED_TEST_SUITE(EveryPointType, PointTypes);

/// Expects the sphere that every point type must give. Not in the test of types, which is compiled for each.
void expectSphere(const pcl::PolygonMesh& output, const pcl::mrf::Report& report)
{
  const pcl::mrf::TriangleMesh mesh = conversion::plain(output);
  const pcl::mrf::MeshStatistics statistics = pcl::mrf::measure(mesh);
  EXPECT_TRUE(statistics.closed() && statistics.manifold());
  EXPECT_EQ(statistics.eulerCharacteristic, 2);
  EXPECT_EQ(statistics.components, 1);
  EXPECT_EQ(statistics.triangles, report.mesh.triangles);
  // Points of spacing 0.15 on curvature 1: chords and tangents are off by spacing²/2 = 1 %, thrice that in the volume.
  EXPECT_NEAR(statistics.volume, 4 * M_PI / 3, .05 * 4 * M_PI / 3);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    EXPECT_NEAR(mesh.normals[v].norm(), 1, 1e-5);
    EXPECT_GT(mesh.normals[v].dot(mesh.vertices[v].normalized()), .95f) << "outward";
  }

  for (const char* field : {"x", "y", "z", "normal_x", "normal_y", "normal_z", "confidence"})
    EXPECT_TRUE(conversion::hasField(output, field)) << field;
  EXPECT_EQ(output.header.frame_id, "scanner");
  EXPECT_EQ(output.header.stamp, 1234567u);
  EXPECT_EQ(output.cloud.header.frame_id, "scanner");
}

TYPED_TEST(EveryPointType, GivesAClosedSphereThroughBothOverloads)
{
  using Point = TypeParam;
  typename pcl::PointCloud<Point>::Ptr cloud = conversion::make<Point>(sphere());
  cloud->header.frame_id = "scanner";
  cloud->header.stamp = 1234567;
  On<Point> mrf(cloud);
  const pcl::PolygonMesh output = outputOf(mrf);
  const pcl::mrf::Report report = mrf.getReport();
  EXPECT_EQ(report.normalsEstimated, !pcl::traits::has_normal<Point>::value);
  EXPECT_EQ(report.points.used, static_cast<std::int64_t>(cloud->size()));

  const pcl::mrf::TriangleMesh mesh = conversion::plain(output);
  expectSphere(output, report);
  EXPECT_EQ(conversion::hasField(output, "rgb"), pcl::traits::has_color<Point>::value);
  EXPECT_EQ(conversion::hasField(output, "intensity"), pcl::traits::has_intensity<Point>::value);

  pcl::PointCloud<Point> points;
  std::vector<pcl::Vertices> polygons;
  mrf.reconstruct(points, polygons);
  EXPECT_EQ(points.header.frame_id, "scanner");
  EXPECT_EQ(conversion::triangles(polygons), mesh.triangles);
  ASSERT_EQ(points.size(), mesh.vertices.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    EXPECT_EQ(Eigen::Vector3f(points[v].getVector3fMap()), mesh.vertices[v]);
    if constexpr (pcl::traits::has_normal<Point>::value) {
      EXPECT_EQ(Eigen::Vector3f(points[v].getNormalVector3fMap()), mesh.normals[v]);
    }
    if constexpr (pcl::traits::has_field<Point, pcl::fields::confidence>::value) {
      EXPECT_EQ(points[v].confidence, mesh.confidences[v]);
    }
  }
}

TYPED_TEST(EveryPointType, RefusesNormalsThatTheTypeLacks)
{
  using Point = TypeParam;
  for (const auto source : {pcl::mrf::NormalSource::use, pcl::mrf::NormalSource::reference}) {
    On<Point> mrf;
    mrf.setNormalSource(source);
    if (!pcl::traits::has_normal<Point>::value) {
      expectFailure(mrf, Status::invalidOption, "normals");
      continue;
    }
    outputOf(mrf);
    EXPECT_EQ(mrf.getReport().normalsEstimated, source == pcl::mrf::NormalSource::reference);
  }
}

TEST(Interface, HonoursIndices)
{
  Cloud::Ptr both = sphereCloud();
  pcl::IndicesPtr indices(new pcl::Indices);
  for (std::size_t i = 0; i < sphere().size(); ++i) {
    pcl::PointNormal point = (*both)[i];
    point.x += 10;
    indices->push_back(static_cast<int>(both->size()));
    both->push_back(point);
  }
  On<pcl::PointNormal> mrf(both);
  EXPECT_EQ(pcl::mrf::measure(run(mrf)).components, 2);
  mrf.setIndices(indices);
  const pcl::mrf::TriangleMesh mesh = run(mrf);
  EXPECT_EQ(pcl::mrf::measure(mesh).components, 1);
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    EXPECT_GT(vertex.x(), 8);
  EXPECT_EQ(mrf.getReport().points.input, static_cast<std::int64_t>(indices->size()));
}

TEST(Interface, WorksThroughBaseClassPointers)
{
  const pcl::SurfaceReconstruction<pcl::PointNormal>::Ptr surface(new Mrf);
  const pcl::PCLSurfaceBase<pcl::PointNormal>::Ptr base(new Mrf);
  surface->setInputCloud(sphereCloud());
  base->setInputCloud(sphereCloud());
  pcl::PolygonMesh first, second;
  surface->reconstruct(first);
  base->reconstruct(second);
  EXPECT_TRUE(sameBytes(conversion::plain(first), meshOf(sphereCloud)));
  EXPECT_TRUE(sameBytes(conversion::plain(second), meshOf(sphereCloud)));
}

TEST(Interface, OneObjectServesManyClouds)
{
  OnSphere mrf;
  run(mrf);
  mrf.setInputCloud(Cloud::Ptr(new Cloud));
  expectFailure(mrf, Status::invalidInput);
  const Cloud::Ptr torus = torusCloud();
  mrf.setInputCloud(torus);
  EXPECT_TRUE(sameBytes(run(mrf), meshOf(torusCloud))) << "nothing of the earlier runs is left";
  EXPECT_EQ(mrf.getReport().points.input, static_cast<std::int64_t>(torus->size()));
  EXPECT_TRUE(mrf.getReport().warnings.empty()) << mrf.getReport().warnings.front();
}

TEST(Report, NamesALevelThatHasNotConverged)
{
  OnSphere mrf;
  pcl::mrf::Options options = mrf.getOptions();
  options.solver.maxIterations = 1;
  mrf.setOptions(options);
  run(mrf);
  ASSERT_EQ(mrf.getReport().warnings.size(), 1u);
  EXPECT_NE(mrf.getReport().warnings[0].find("has not converged after 1 iteration"), std::string::npos)
      << mrf.getReport().warnings[0];
  EXPECT_NE(mrf.getReport().warnings[0].find("solver.maxIterations"), std::string::npos);
}

/// Counts its queries.
struct CountingSearch : ChangedSearch {
  std::atomic<int> queries{0};
  CountingSearch() : ChangedSearch([this](int found, pcl::Indices&, std::vector<float>&) { return ++queries, found; })
  {}
};

TEST(Interface, AsksTheGivenSearchObject)
{
  OnSphere mrf;
  const pcl::shared_ptr<CountingSearch> search(new CountingSearch);
  mrf.setSearchMethod(search);
  const pcl::mrf::TriangleMesh& expected = meshOf(sphereCloud);
  EXPECT_TRUE(sameBytes(run(mrf), expected)) << "the same exact queries";
  // One query per point for the spacing, one per vertex for the confidence.
  EXPECT_GE(search->queries, static_cast<int>(sphere().size() + expected.vertices.size()));
}

TEST(Interface, AnOrganizedCloudWorksWithPclsSearchOfOrganizedClouds)
{
  const Cloud::Ptr cloud = conversion::make<pcl::PointNormal>(patch());
  for (pcl::PointNormal& point : *cloud)
    point.z += 3; // before the camera
  cloud->resize(cloud->size() / 19 * 19);
  cloud->width = 19;
  cloud->height = static_cast<std::uint32_t>(cloud->size() / 19);
  On<pcl::PointNormal> mrf(cloud);
  const pcl::mrf::TriangleMesh expected = run(mrf);
  const pcl::search::OrganizedNeighbor<pcl::PointNormal>::Ptr search(
      new pcl::search::OrganizedNeighbor<pcl::PointNormal>);
  mrf.setSearchMethod(search);
  EXPECT_TRUE(sameBytes(run(mrf), expected));
  EXPECT_FALSE(search->getInputCloud()) << "it is not asked";
}

TEST(Interface, AFilledCloudHasTheInputsPose)
{
  const Cloud::Ptr cloud = sphereCloud();
  cloud->sensor_origin_ = {0, 0, 3, 0};
  cloud->sensor_orientation_ = Eigen::Quaternionf(Eigen::AngleAxisf(.5f, Eigen::Vector3f::UnitX()));
  On<pcl::PointNormal> mrf(cloud);
  Outputs<pcl::PointNormal> outputs;
  mrf.reconstruct(outputs.points, outputs.polygons);
  EXPECT_EQ(outputs.points.sensor_origin_, cloud->sensor_origin_);
  EXPECT_EQ(outputs.points.sensor_orientation_.coeffs(), cloud->sensor_orientation_.coeffs());
}

TEST(PaperPreset, RunsPclsOwnParts)
{
  OnSphere mrf;
  mrf.setPreset(pcl::mrf::Preset::paper);
  const pcl::mrf::TriangleMesh expected = run(mrf);
  const pcl::shared_ptr<CountingSearch> search(new CountingSearch);
  mrf.setSearchMethod(search);
  std::vector<std::string> stages;
  std::vector<int> queries; ///< before each stage
  mrf.setProgressCallback([&](const std::string& stage, double) {
    if (stages.empty() || stages.back() != stage) {
      stages.push_back(stage);
      queries.push_back(search->queries);
    }
    return true;
  });
  EXPECT_TRUE(sameBytes(run(mrf), expected)) << "by itself it searches in PCL's kd-tree";
  queries.push_back(search->queries);
  const auto asked = [&](const char* stage) {
    const auto at = static_cast<std::size_t>(std::find(stages.begin(), stages.end(), stage) - stages.begin());
    return at < stages.size() ? queries[at + 1] - queries[at] : -1;
  };
  const auto count = static_cast<int>(mrf.getReport().points.used);
  EXPECT_GE(asked("outliers"), count) << "for the spacing";
  EXPECT_GE(asked("normals"), 2 * count) << "by NormalEstimationOMP, and for the distances from the planes";
  EXPECT_GT(asked("orientation"), 0);
  EXPECT_GE(asked("regularization"), count) << "one for each voxel near the points";
  EXPECT_GE(asked("trimming"), static_cast<int>(mrf.getReport().meshBeforeRemeshing.vertices));
}

TEST(Interface, TheOutputMayBeTheInput)
{
  const Cloud::Ptr cloud = sphereCloud();
  Cloud vertices;
  std::vector<pcl::Vertices> polygons, same;
  On<pcl::PointNormal> mrf(cloud);
  mrf.reconstruct(vertices, polygons);
  mrf.reconstruct(*cloud, same);
  EXPECT_EQ(cloud->size(), vertices.size());
  EXPECT_EQ(same.size(), polygons.size());
  EXPECT_GT(same.size(), 100u);
}

TEST(Interface, TheGivenSearchObjectIsLeftAsItWas)
{
  const Cloud::Ptr own = conversion::make<pcl::PointNormal>(patch());
  const pcl::IndicesPtr indices(new pcl::Indices{3, 5, 8, 13, 21});
  const pcl::search::KdTree<pcl::PointNormal>::Ptr used(new pcl::search::KdTree<pcl::PointNormal>),
      fresh(new pcl::search::KdTree<pcl::PointNormal>);
  used->setInputCloud(own, indices);
  OnSphere mrf;
  mrf.setSearchMethod(used);
  run(mrf);
  EXPECT_EQ(used->getInputCloud(), own);
  EXPECT_EQ(used->getIndices(), indices);
  pcl::Indices found;
  std::vector<float> distances;
  EXPECT_EQ(used->nearestKSearch((*own)[8], 100, found, distances), 5) << "its answers are its own points again";
  EXPECT_EQ(found.front(), 8);

  // After a failure, too. By the stage: fractions follow the clock as well.
  mrf.setProgressCallback([](const std::string& stage, double) { return stage != "smoothing length"; });
  expectFailure(mrf, Status::cancelled);
  EXPECT_EQ(used->getInputCloud(), own);

  mrf.setProgressCallback({});
  mrf.setSearchMethod(fresh);
  run(mrf);
  EXPECT_EQ(fresh->getInputCloud(), mrf.getInputCloud()) << "as PCL's own classes leave it";
}

TEST(Interface, TheGivenRunnerDoesTilesAndParts)
{
  struct Refusing : pcl::mrf::TaskRunner {
    void run(const std::string& kind, int count, const MakeInput&, const UseResult&, pcl::mrf::Execution&) override
    {
      throw pcl::mrf::ResourceLimit("refused: " + kind + " of " + std::to_string(count));
    }
  } refusing;
  pcl::mrf::Options options;
  options.multiscale.voxelSize = .014f;
  options.multiscale.denseVoxels = 1 << 15;
  options.multiscale.maxMemory = 34 << 20;
  OnSphere mrf;
  mrf.setInputCloud(conversion::make<pcl::PointNormal>(shapes::sample(shapes::torus(1, .4), 1.6, .014)));
  mrf.setOptions(options);
  mrf.setTaskRunner(&refusing);
  EXPECT_EQ(mrf.getTaskRunner(), &refusing);
  EXPECT_EQ(expectFailure(mrf, Status::resourceLimit).find("refused: tile of "), 0u);
}

TEST(Interface, TwoObjectsRunInTwoThreads)
{
  Mrf first, second;
  first.setInputCloud(sphereCloud());
  second.setInputCloud(torusCloud());
  pcl::mrf::TriangleMesh firstMesh, secondMesh;
  std::thread other([&] { secondMesh = run(second); });
  firstMesh = run(first);
  other.join();
  EXPECT_TRUE(sameBytes(firstMesh, meshOf(sphereCloud)));
  EXPECT_TRUE(sameBytes(secondMesh, meshOf(torusCloud)));
}

TEST(Interface, SettersReachTheOptionsAndGettersTellThem)
{
  Mrf mrf;
  mrf.setPreset(pcl::mrf::Preset::paper);
  EXPECT_EQ(mrf.getPreset(), pcl::mrf::Preset::paper);
  EXPECT_EQ(mrf.getObservation(), pcl::mrf::ObservationKind::median);
  EXPECT_EQ(mrf.getBeta(), pcl::mrf::paperPreset().prior.beta);
  mrf.setPreset(pcl::mrf::Preset::standard);
  EXPECT_EQ(mrf.getObservation(), pcl::mrf::ObservationKind::points) << "of the paper's nothing is left";

  const pcl::mrf::Options& o = mrf.getOptions();
  const auto expectSet = [&](const auto& value, auto set, auto get, const auto& member) {
    (mrf.*set)(value);
    EXPECT_EQ((mrf.*get)(), value);
    EXPECT_EQ(member, value);
  };
  expectSet(pcl::mrf::Quality::fine, &Mrf::setQuality, &Mrf::getQuality, o.multiscale.quality);
  expectSet(.5f, &Mrf::setSmoothing, &Mrf::getSmoothing, o.observation.smoothing);
  expectSet(.25f, &Mrf::setNoise, &Mrf::getNoise, o.observation.noise);
  expectSet(true, &Mrf::setRobust, &Mrf::getRobust, o.outliers.robust);
  expectSet(3.f, &Mrf::setMaxHole, &Mrf::getMaxHole, o.trimming.maxHole);
  expectSet(.125f, &Mrf::setTargetEdge, &Mrf::getTargetEdge, o.remesher.targetEdge);
  expectSet(std::int64_t{900}, &Mrf::setTargetTriangles, &Mrf::getTargetTriangles, o.remesher.triangles);
  expectSet(4, &Mrf::setNumberOfRemeshingRounds, &Mrf::getNumberOfRemeshingRounds, o.remesher.rounds);
  expectSet(std::string("curvature"), &Mrf::setConfidenceField, &Mrf::getConfidenceField, o.confidenceField);
  expectSet(std::string("intensity"), &Mrf::setNoiseField, &Mrf::getNoiseField, o.noiseField);
  expectSet(std::string("tof:.5,.25"), &Mrf::setNoiseModel, &Mrf::getNoiseModel, o.observation.noiseModel);
  expectSet(pcl::mrf::ObservationKind::plane, &Mrf::setObservation, &Mrf::getObservation, o.observation.kind);
  expectSet(true, &Mrf::setComputeUncertainty, &Mrf::getComputeUncertainty, o.uncertainty.compute);
  expectSet(2, &Mrf::setNumberOfSurfaces, &Mrf::getNumberOfSurfaces, o.uncertainty.surfaces);
  mrf.setThrowing(true);
  mrf.setProgressCallback([](const std::string&, double) { return false; });
  mrf.setSensorPositions({{1, 2, 3}, {4, 5, 6}}, {0, 1, 1});
  EXPECT_TRUE(mrf.getThrowing());
  EXPECT_FALSE(mrf.getProgressCallback()("", 0));
  EXPECT_EQ(mrf.getSensorPositions().at(1), Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(mrf.getSensorViews(), (std::vector<std::int32_t>{0, 1, 1}));
  EXPECT_TRUE(mrf.getUseSensorOrigin());
  mrf.setUseSensorOrigin(false);
  EXPECT_FALSE(mrf.getUseSensorOrigin());
  // As PCL has them.
  mrf.setSensorPosition(Eigen::Vector4f(1, 2, 3, 0));
  EXPECT_EQ(mrf.getSensorPositions(), std::vector<Eigen::Vector3d>{Eigen::Vector3d(1, 2, 3)});
  mrf.setSensorPosition(Eigen::Vector3f(4, 5, 6));
  EXPECT_EQ(mrf.getSensorPositions(), std::vector<Eigen::Vector3d>{Eigen::Vector3d(4, 5, 6)});

  struct Named : Mrf {
    using Mrf::getClassName;
  };
  EXPECT_EQ(Named().getClassName(), "MRFReconstruction");
  EXPECT_EQ(toString(Named().getReport().status), std::string("not run"));
}

TEST(Interface, TellsOfABetaThatHasNoEffect)
{
  OnSphere mrf;
  mrf.setBeta(.5f);
  run(mrf);
  ASSERT_EQ(mrf.getReport().warnings.size(), 1u);
  EXPECT_NE(mrf.getReport().warnings.front().find("setBeta(0.5) has no effect"), std::string::npos)
      << mrf.getReport().warnings.front();
  mrf.setObservation(pcl::mrf::ObservationKind::plane);
  run(mrf);
  EXPECT_TRUE(mrf.getReport().warnings.empty()) << mrf.getReport().warnings.front();
}

TEST(Interface, KeepsTheResultOnRequestOnly)
{
  OnSphere mrf;
  const pcl::mrf::TriangleMesh mesh = run(mrf);
  EXPECT_TRUE(mrf.getDistanceField().empty());
  EXPECT_TRUE(mrf.getResult().mesh.vertices.empty());
  EXPECT_EQ(mrf.getResult().points.positions.capacity(), 0u) << "their memory is free as well";
  EXPECT_EQ(mrf.getReport().mesh.triangles, static_cast<std::int64_t>(mesh.triangles.size()));

  mrf.setKeepResult(true);
  mrf.setNumberOfSurfaces(2);
  run(mrf);
  ASSERT_EQ(mrf.getResult().surfaces.size(), 2u);
  EXPECT_EQ(mrf.getResult().surfaces[1].size(), mesh.vertices.size());
  EXPECT_EQ(mrf.getResult().mesh.triangles, mesh.triangles);
  const pcl::mrf::OrientedPoints& points = mrf.getResult().points;
  EXPECT_EQ(points.size(), sphere().size());
  EXPECT_EQ(points.normals.size(), points.size());
  EXPECT_EQ(points.origins.size(), points.size());
  EXPECT_FALSE(mrf.getDistanceField().empty());
  mrf.releaseResult();
  EXPECT_TRUE(mrf.getDistanceField().empty());
  EXPECT_EQ(mrf.getResult().mesh.vertices.capacity(), 0u);
  EXPECT_TRUE(mrf.getResult().surfaces.empty());
  EXPECT_EQ(mrf.getReport().status, Status::ok) << "the report stays";
}

TEST(Interface, FieldIsReadableAndFitsTheMesh)
{
  Cloud::Ptr cloud = sphereCloud();
  for (pcl::PointNormal& point : *cloud)
    point.getVector3fMap() += Eigen::Vector3f(100, 200, 300);
  Mrf mrf;
  mrf.setKeepResult(true);
  mrf.setInputCloud(cloud);
  EXPECT_TRUE(mrf.getDistanceField().empty());
  const pcl::mrf::TriangleMesh mesh = run(mrf);
  const pcl::mrf::DistanceField& field = mrf.getDistanceField();
  ASSERT_FALSE(field.empty());
  const double h = field.lattice().spacing;
  EXPECT_NEAR(h, 2 * mrf.getReport().density.spacing, 1e-6);
  EXPECT_NEAR(mrf.getReport().options.multiscale.voxelSize, h, 1e-6) << "the report shows what was derived";
  EXPECT_EQ(mrf.getOptions().multiscale.voxelSize, 0) << "the request stays as it was";
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    const Eigen::Vector3f position = (vertex.cast<double>() - mrf.getOffset()).cast<float>();
    EXPECT_LT(std::abs(field.sampleDistance(position)), .1 * h);
  }
  const Eigen::Vector3f center = (Eigen::Vector3d(100, 200, 300) - mrf.getOffset()).cast<float>();
  EXPECT_LT(field.sampleDistance(center), -h) << "negative inside";
}

TEST(VertexFields, SigmaAndItsColors)
{
  On<pcl::PointXYZRGBNormal> mrf;
  mrf.setColorMode(pcl::mrf::ColorMode::sigma);
  const pcl::PolygonMesh mesh = outputOf(mrf);
  const std::vector<float> sigmas = conversion::values(mesh.cloud, "sigma");
  ASSERT_EQ(sigmas.size(), mesh.cloud.width);
  ASSERT_EQ(conversion::values(mesh.cloud, "sigma_calibrated").size(), sigmas.size());
  const auto largest = static_cast<std::size_t>(std::max_element(sigmas.begin(), sigmas.end()) - sigmas.begin());
  const pcl::mrf::SigmaQuantiles& measured = mrf.getReport().uncertainty.measured;
  EXPECT_EQ(measured.vertices, static_cast<std::int64_t>(sigmas.size())) << "a whole sphere";
  EXPECT_FLOAT_EQ(sigmas[largest], static_cast<float>(measured.max));
  pcl::PointCloud<pcl::PointXYZRGBNormal> points;
  pcl::fromPCLPointCloud2(mesh.cloud, points);
  EXPECT_GT(points[largest].r, 2 * points[largest].b) << "red";
}

TEST(VertexFields, ColorModes)
{
  On<pcl::PointXYZRGB> colored;
  colored.setColorMode(pcl::mrf::ColorMode::none);
  pcl::PolygonMesh output = outputOf(colored);
  EXPECT_FALSE(conversion::hasField(output, "rgb"));

  OnSphere mrf;
  mrf.setColorMode(pcl::mrf::ColorMode::confidence);
  output = outputOf(mrf);
  ASSERT_TRUE(conversion::hasField(output, "rgb"));
  pcl::PointCloud<pcl::PointXYZRGB> points;
  pcl::fromPCLPointCloud2(output.cloud, points);
  const std::vector<float> confidences = conversion::plain(output).confidences;
  for (std::size_t v = 0; v < points.size(); ++v)
    EXPECT_EQ((pcl::mrf::Rgb{points[v].r, points[v].g, points[v].b}), pcl::mrf::confidenceColor(confidences[v]));
}

TEST(VertexFields, PointConfidencesWeighTheData)
{
  // Points without confidence are dropped; a low confidence of the points is one of the surface.
  pcl::PointCloud<pcl::PointXYZINormal>::Ptr cloud = conversion::make<pcl::PointXYZINormal>(sphere());
  for (pcl::PointXYZINormal& point : *cloud)
    point.intensity = point.z > 0 ? 1 : 0;
  On<pcl::PointXYZINormal> mrf(cloud);
  pcl::mrf::Options options;
  options.confidenceField = "intensity";
  options.trimming.kind = pcl::mrf::Trimming::none;
  mrf.setOptions(options);
  outputOf(mrf);
  std::int64_t trusted = 0;
  for (const pcl::PointXYZINormal& point : *cloud)
    trusted += point.z > 0;
  EXPECT_EQ(mrf.getReport().points.used, trusted);
  EXPECT_EQ(mrf.getReport().points.zeroConfidence, static_cast<std::int64_t>(cloud->size()) - trusted);

  for (pcl::PointXYZINormal& point : *cloud)
    point.intensity = .1f;
  const std::vector<float> confidences = run(mrf).confidences;
  EXPECT_LE(*std::max_element(confidences.begin(), confidences.end()), .1001f) << "the scanner's multiplies α";
}

TEST(Sensors, TheCloudsOwnOriginIsOneIfItIsSetOrTheCloudIsOrganized)
{
  // Far from zero, so that an origin in another frame than the points' would be on the other side.
  pcl::mrf::PointSet points = patch();
  points.offset = {0, 0, -50};
  float mirrored = 1;
  const auto run = [&](const Eigen::Vector3f& origin, bool organized, const auto& change) {
    const auto cloud = conversion::make<pcl::PointXYZ>(points);
    cloud->sensor_origin_.head<3>() = origin;
    if (organized) { // rows go down for who looks from zero, columns to the right
      *cloud = pcl::PointCloud<pcl::PointXYZ>(40, 40);
      for (int row = 0; row < 40; ++row)
        for (int column = 0; column < 40; ++column)
          cloud->at(column, row) = {mirrored * .05f * static_cast<float>(column), -.05f * static_cast<float>(row), -50};
      cloud->sensor_origin_.head<3>() = origin;
    }
    On<pcl::PointXYZ> mrf(cloud);
    change(mrf);
    const pcl::mrf::TriangleMesh mesh = contract::run(mrf);
    // Which of the two sides the mesh faces, where the sensor decided it.
    const bool isSeen = mrf.getReport().vote == pcl::mrf::OrientationVote::sensor;
    return std::make_pair(isSeen ? std::lround(mesh.normals.at(0).z()) : 0, mrf.getReport().sensorOriginUsed);
  };
  const auto asIs = [](auto&) {};
  const Eigen::Vector3f zero = Eigen::Vector3f::Zero(), below(0, 0, -55), above(0, 0, -45);
  EXPECT_EQ(run(below, false, asIs), std::make_pair(-1L, true));
  EXPECT_EQ(run(above, false, asIs), std::make_pair(1L, true));
  EXPECT_EQ(run(zero, true, asIs), std::make_pair(1L, true)) << "organized: zero is above the patch";
  EXPECT_EQ(run(zero, false, asIs), std::make_pair(0L, false)) << "nobody set it";
  EXPECT_EQ(run({NAN, 0, 0}, true, asIs), std::make_pair(0L, false));
  EXPECT_EQ(run(below, false, [](auto& mrf) { mrf.setUseSensorOrigin(false); }), std::make_pair(0L, false));
  EXPECT_EQ(run(below, true,
                [](auto& mrf) {
                  mrf.setSensorPosition({0, 0, -45});
                }),
            std::make_pair(1L, false))
      << "a given position wins";
  mirrored = -1;
  EXPECT_EQ(run(zero, true, asIs), std::make_pair(0L, false)) << "moved, so that zero is behind the patch";
  EXPECT_EQ(run(below, true, asIs), std::make_pair(-1L, true));
}

TEST(Sensors, NormalsThatLookAtTheOriginSupposeOneThere)
{
  const auto isSupposed = [](const pcl::mrf::PointSet& points, const auto& change) {
    On<pcl::PointNormal> mrf(points);
    change(mrf);
    outputOf(mrf);
    return mrf.getReport().sensorSupposed;
  };
  const auto asIs = [](auto&) {};
  pcl::mrf::PointSet below = patch(), above = patch();
  for (Eigen::Vector3f& x : below.positions)
    x.z() -= 5;
  for (Eigen::Vector3f& x : above.positions)
    x.z() += 5;
  EXPECT_TRUE(isSupposed(below, asIs));
  EXPECT_FALSE(isSupposed(above, asIs)) << "all normals look away from it";
  pcl::mrf::PointSet farBelow = patch();
  farBelow.offset.z() -= 5000;
  EXPECT_FALSE(isSupposed(farBelow, asIs)) << "nobody measures from so far";
  EXPECT_FALSE(isSupposed(below, [](auto& mrf) { mrf.setSensorPosition({0, 0, 9}); })) << "it is known";
  EXPECT_FALSE(isSupposed(below, [](auto& mrf) { mrf.setUseSensorOrigin(false); }));
  for (const std::size_t i : {0, 1})
    below.normals[i] = -below.normals[i];
  ASSERT_LT(below.size(), 2000U);
  EXPECT_FALSE(isSupposed(below, asIs)) << "more than one in a thousand look elsewhere";
}

TEST(Sensors, ViewsAreOfTheCloudNotOfTheIndices)
{
  // Two parallel patches seen from between them, and indices that drop every other point.
  pcl::mrf::PointSet lower = patch();
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  std::vector<std::int32_t> views;
  for (const int level : {0, 1})
    for (const Eigen::Vector3f& position : lower.positions) {
      cloud->push_back(pcl::PointXYZ(position.x(), position.y(), position.z() + 4 * static_cast<float>(level)));
      views.push_back(level);
    }
  pcl::IndicesPtr indices(new pcl::Indices);
  for (std::size_t i = 0; i < cloud->size(); ++i)
    if (i % 3 != 0)
      indices->push_back(static_cast<int>(i));
  On<pcl::PointXYZ> mrf(cloud);
  mrf.setIndices(indices);
  // Each patch is nearer to the other one's sensor: only the views tell.
  mrf.setSensorPositions({Eigen::Vector3d(0, 0, 3.5), Eigen::Vector3d(0, 0, .5)}, views);
  const pcl::mrf::TriangleMesh mesh = run(mrf);
  EXPECT_GT(mrf.getReport().orientation.agreement, .99);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    EXPECT_GT(mesh.normals[v].z() * (mesh.vertices[v].z() < 2 ? 1.f : -1.f), .5f) << mesh.vertices[v].transpose();
}

TEST(Progress, ReportsStagesAndFractions)
{
  OnSphere mrf;
  std::vector<std::string> stages;
  double last = 0;
  mrf.setProgressCallback([&](const std::string& stage, double fraction) {
    EXPECT_GE(fraction, last) << stage << ": of the whole run";
    EXPECT_LE(fraction, 1);
    if (stages.empty() || stages.back() != stage) {
      EXPECT_FALSE(stages.empty() && fraction > .01) << "begins with " << fraction;
      stages.push_back(stage);
    }
    last = fraction;
    return true;
  });
  run(mrf);
  EXPECT_EQ(last, 1);
  EXPECT_GE(stages.size(), 5u);
  ASSERT_FALSE(mrf.getReport().times.empty());
  for (const pcl::mrf::StageTime& time : mrf.getReport().times)
    EXPECT_NE(std::find(stages.begin(), stages.end(), time.stage), stages.end()) << time.stage;
}

TEST(Errors, AreRethrownOnRequest)
{
  Mrf mrf;
  mrf.setThrowing(true);
  Outputs<pcl::PointNormal> outputs;
  EXPECT_THROW(mrf.reconstruct(outputs.mesh), pcl::mrf::InvalidInput);
  EXPECT_TRUE(outputs.mesh.polygons.empty() && outputs.mesh.cloud.data.empty());
  EXPECT_EQ(mrf.getReport().status, Status::invalidInput);

  mrf.setInputCloud(sphereCloud());
  mrf.setBeta(1.5f);
  EXPECT_THROW(mrf.reconstruct(outputs.points, outputs.polygons), pcl::mrf::InvalidOption);
  EXPECT_TRUE(outputs.points.empty() && outputs.polygons.empty());
  EXPECT_THROW(mrf.reconstruct(outputs.mesh), pcl::PCLException) << "PCL's own type catches them as well";

  mrf.setBeta(.99f);
  mrf.setProgressCallback([](const std::string&, double) { return false; });
  EXPECT_THROW(mrf.reconstruct(outputs.mesh), pcl::mrf::Cancelled);
}

TEST(Padding, IsUsableUpToItsLimit)
{
  pcl::mrf::Options options;
  options.multiscale.padding = 100;
  options.trimming.kind = pcl::mrf::Trimming::none; // what is far away is looked at as well
  Mrf mrf;
  mrf.setKeepResult(true);
  mrf.setOptions(options);
  mrf.setInputCloud(sphereCloud());
  EXPECT_TRUE(pcl::mrf::measure(run(mrf)).closed());
  const pcl::mrf::GridSize size = mrf.getDistanceField().lattice().size;
  EXPECT_GE(std::min({size.x, size.y, size.z}), 200);
  // Few points, whose surface goes on to the end of the volume.
  pcl::mrf::PointSet few = patch();
  few.positions.resize(20);
  few.normals.resize(20);
  mrf.setInputCloud(conversion::make<pcl::PointNormal>(few));
  EXPECT_GT(run(mrf).triangles.size(), 1000u);
}

TEST(Errors, AFieldWithoutAZeroLevelIsBlamedOnBetaAtVoxels)
{
  OnSphere mrf;
  mrf.setObservation(pcl::mrf::ObservationKind::plane);
  mrf.setBeta(1e-10f);
  expectFailure(mrf, Status::invalidInput, "setBeta(1e-10) is too small");
  // At points it has no effect, and nothing to be blamed for.
  mrf.setObservation(pcl::mrf::ObservationKind::points);
  run(mrf);
}

TEST(Errors, MemoryLimitHoldsForTheRobustField)
{
  OnSphere mrf;
  pcl::mrf::Options options;
  options.outliers.robust = true;
  options.multiscale.maxMemory = 1 << 16;
  mrf.setOptions(options);
  expectFailure(mrf, Status::resourceLimit, "setRobust");
  EXPECT_EQ(mrf.getReport().times.back().stage, "robust field") << "before five solutions are made for nothing";
}
