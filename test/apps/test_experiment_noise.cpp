// SPDX-License-Identifier: BSD-3-Clause
// Noise and outliers, random scans: what is measured, what counts as a fault, the tables made of results.
#include "experiments/comparisons.h"
#include "experiments/noise.h"
#include "experiments/random_scans.h"
#include "support/laboratory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

using namespace mrf_apps;
using Eigen::Vector3d;
using Eigen::Vector3f;
using mrf_test::MadeUp;
using nlohmann::json;
using pcl::mrf::Execution;
using pcl::mrf::Reconstruction;
using pcl::mrf::scan::Length;
using pcl::mrf::scan::Scan;

namespace {

/// A tetrahedron with normals out of it, as a result that trimmed nothing.
Reconstruction tetrahedron(const Vector3f& offset = Vector3f::Zero())
{
  Reconstruction result;
  for (const Vector3f& corner : {Vector3f(0, 0, 0), Vector3f(1, 0, 0), Vector3f(0, 1, 0), Vector3f(0, 0, 1)}) {
    result.mesh.vertices.push_back(corner + offset);
    result.mesh.normals.push_back((corner - Vector3f::Constant(.25f)).normalized());
    result.mesh.confidences.push_back(1);
  }
  result.mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return result;
}

/// The faults in one string.
std::string faults(const Reconstruction& result)
{
  Execution execution(1);
  std::string all;
  for (const std::string& fault : faultsOf(result, execution))
    all += fault + "\n";
  return all;
}

bool contains(const std::string& text, const std::string& part)
{
  return text.find(part) != std::string::npos;
}

/// A unit sphere, seen from all sides.
Scan sphereScan(double noise, double outliers)
{
  pcl::mrf::scan::ScanOptions options;
  options.sampling.points = 3000;
  options.noise = {noise, Length::Unit::spacings};
  options.uniformOutliers = outliers;
  Execution execution(2);
  return simulateScan(*loadShape("sphere").surface, options, execution);
}

json resultOfNoise(double accuracy)
{
  return {{"accuracy", accuracy},
          {"inSpacings", 2 * accuracy},
          {"holes", {accuracy, json(), 4 * accuracy}},
          {"reference", .75},
          {"invented", 3},
          {"components", 1},
          {"boundaryLoops", 0},
          {"flaws", 0},
          {"smoothing", 1.25},
          {"noise", 1.5},
          {"processorSeconds", 2}};
}

json resultOfMesh()
{
  return {{"faults", json::array()}, {"triangles", 100}, {"components", 1},     {"closed", true},
          {"meanQuality", .95},      {"minQuality", .5}, {"regularShare", .75}, {"refused", 0}};
}

} // namespace

TEST(Faults, areNamed)
{
  EXPECT_EQ(faults(tetrahedron()), "");

  Reconstruction inverted = tetrahedron();
  for (auto& triangle : inverted.mesh.triangles)
    std::swap(triangle[0], triangle[1]);
  EXPECT_EQ(faults(inverted), "closed, but inside out\n");

  Reconstruction open = tetrahedron();
  open.mesh.triangles.pop_back();
  EXPECT_TRUE(contains(faults(open), "openings"));
  open.report.trimming.extrapolationsDropped = 1;
  EXPECT_EQ(faults(open), "") << "trimming makes openings";

  Reconstruction turned = tetrahedron();
  std::swap(turned.mesh.triangles[0][0], turned.mesh.triangles[0][1]);
  EXPECT_TRUE(contains(faults(turned), "3 edges that are not manifold"));

  Reconstruction crossing = tetrahedron();
  const Reconstruction other = tetrahedron(Vector3f(.125f, .0625f, .03125f));
  for (std::size_t v = 0; v < 4; ++v) {
    crossing.mesh.vertices.push_back(other.mesh.vertices[v]);
    crossing.mesh.normals.push_back(other.mesh.normals[v]);
    crossing.mesh.confidences.push_back(1);
  }
  for (const auto& [a, b, c] : other.mesh.triangles)
    crossing.mesh.triangles.push_back({a + 4, b + 4, c + 4});
  EXPECT_TRUE(contains(faults(crossing), "intersect others"));

  Reconstruction flat = tetrahedron();
  flat.mesh.vertices[3] = Vector3f(.5f, .5f, 0);
  EXPECT_TRUE(contains(faults(flat), "degenerate"));

  Reconstruction bare = tetrahedron();
  bare.mesh.confidences.pop_back();
  EXPECT_TRUE(contains(faults(bare), "fields"));
  EXPECT_TRUE(contains(faults(Reconstruction()), "no triangles"));
}

TEST(RandomScans, areAllThatTheirSeedSays)
{
  std::set<std::string> commands, kinds;
  int withNormals = 0;
  for (int index = 0; index < 100; ++index) {
    const RandomScan random = randomScan(7, index);
    SCOPED_TRACE(random.commands());
    EXPECT_EQ(random.commands(), randomScan(7, index).commands());
    EXPECT_TRUE(commands.insert(random.commands()).second);
    EXPECT_NE(random.commands(), randomScan(8, index).commands());
    kinds.insert(random.kind);
    withNormals += random.hasNormals ? 1 : 0;
    EXPECT_GE(random.options.sampling.points, 3000);
    EXPECT_LE(random.options.sampling.points, 5000);
    EXPECT_LE(random.options.noise.value, 1);
    EXPECT_LE(random.options.uniformOutliers, 3);
    if (random.kind != "bunny") {
      EXPECT_NO_THROW(random.load()) << "parameters are within what the catalog takes";
    }
  }
  EXPECT_EQ(kinds.size(), 12u);
  // A fair coin thrown a hundred times is outside of this once in ten thousand seeds.
  EXPECT_GT(withNormals, 30);
  EXPECT_LT(withNormals, 70);
}

TEST(Noise, estimatedNormalsFaceTheirSensors)
{
  const Scan scan = sphereScan(0, 0);
  Execution execution(2);
  const pcl::mrf::scan::Points points = withEstimatedNormals(scan, execution);
  ASSERT_EQ(points.size(), scan.cloud.size());
  double largest = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    largest = std::max(largest, std::acos(std::min(1., points.normals[i].dot(points.positions[i].normalized()))));
  // A disc of 2.5 spacings, .1 of the radius, lies within .1 of the plane's direction however unevenly it is sampled.
  EXPECT_LT(largest, .1);
}

TEST(Noise, defaultFindsItAndStaysBelow)
{
  const LoadedObject sphere = loadShape("sphere");
  const Scan scan = sphereScan(.5, 2);
  Execution execution(2);
  const json byDefault = measureNoisy(defaultOnNoise(), sphere, scan, execution);
  // 300 held-out points give a deviation to 4 %; the field that they are compared with has an error of its own.
  EXPECT_NEAR(byDefault["noise"], .5, .15);
  EXPECT_GT(byDefault["smoothing"], .5);
  EXPECT_EQ(byDefault["components"], 1);
  const double noisePercent = 100 * .5 * scan.spacing / scan.diagonal;
  EXPECT_LT(byDefault["accuracy"], .5 * noisePercent) << "averaging over many points halves the noise at least";
  EXPECT_LT(byDefault["reference"], .5 * noisePercent);
  EXPECT_EQ(byDefault["invented"], 0);

  const json voxelwise =
      measureNoisy(voxelwiseOnNoise(pcl::mrf::ObservationKind::median, .99), sphere, scan, execution);
  EXPECT_TRUE(voxelwise["noise"].is_null()) << "it looks for none";
  EXPECT_LT(voxelwise["accuracy"], noisePercent);
}

TEST(Noise, peersOnOurPointsGetNoOutliers)
{
  const Scan scan = sphereScan(0, 5);
  Execution execution(2);
  std::vector<std::size_t> counts;
  double farthest = 0;
  std::size_t far = 0;
  const Method probe{"probe", "probe", [&](const pcl::mrf::scan::Points& points, double, Execution&) {
                       counts.push_back(points.size());
                       farthest = 0;
                       far = 0;
                       for (std::size_t i = 0; i < points.size(); ++i) {
                         farthest = std::max(farthest, std::abs(points.positions[i].norm() - 1));
                         far += std::abs(points.positions[i].norm() - 1) > .25 ? 1 : 0;
                       }
                       return SurfaceMesh();
                     }};
  peerOnNoise(probe).run(scan, execution);
  EXPECT_EQ(counts.back(), scan.cloud.size());
  EXPECT_GT(farthest, .3) << "an outlier";
  const std::size_t outliers = far;
  peerOnOurPoints(probe).run(scan, execution);
  EXPECT_GE(counts.back(), scan.clean.size() * 99 / 100);
  // The few that are left have neighbors in a plane with them, by chance: there are no normals to tell.
  EXPECT_LE(10 * far, outliers);
}

TEST(NoiseSection, showsResultsAndFailures)
{
  MadeUp laboratory([](const std::string& key) {
    if (contains(key, "/hoppe"))
      return json{{"failed", "no surface"}};
    return resultOfNoise(contains(key, "/default") ? .125 : .5);
  });
  const Section section = fig8(laboratory);
  std::set<std::string> names;
  int failed = 0, shown = 0;
  for (const Table& table : section.tables) {
    EXPECT_TRUE(names.insert(table.name).second);
    for (const auto& row : table.rows) {
      EXPECT_LE(row.size(), table.columns.size());
      for (const json& cell : row)
        failed += cell == "failed: no surface" ? 1 : 0;
      shown += std::count(row.begin(), row.end(), json(.125)) > 0 ? 1 : 0;
    }
  }
  EXPECT_EQ(names, (std::set<std::string>{"fig-8-chosen", "fig-8-noise", "fig-8-outliers", "fig-8-noisy-scans"}));
  EXPECT_GE(failed, 3) << "under noise, and under both kinds of outliers";
  EXPECT_GE(shown, 4);
  const auto& chosen = section.tables.at(0).rows.at(0);
  EXPECT_EQ(chosen.at(2), 1.5);
  EXPECT_EQ(chosen.at(3), 1.25);
  // Every hole of the default has a quarter of the others' error.
  const Table& scans = section.tables.back();
  ASSERT_GE(scans.rows.size(), 3u);
  EXPECT_EQ(scans.rows[1].at(scans.columns.size() - 3), .25);
  EXPECT_EQ(scans.rows[2].at(2), 1) << "Hoppe failed on the only scan";
  for (const Plot& plot : section.plots)
    for (const Curve& curve : plot.curves) {
      EXPECT_EQ(curve.x.size(), curve.y.size());
      EXPECT_FALSE(contains(curve.name, "Hoppe")) << "it failed";
    }
}

TEST(RobustnessSection, listsFailuresWithWhatRepeatsThem)
{
  MadeUp good([](const std::string&) { return resultOfMesh(); });
  const Section clean = robustness(good);
  ASSERT_EQ(clean.tables.size(), 1u) << "no failures";
  EXPECT_EQ(clean.tables[0].rows.back().at(1), 12);
  EXPECT_EQ(clean.tables[0].rows.back().at(2), 12);
  EXPECT_EQ(clean.tables[0].rows.back().at(4), .95);

  MadeUp bad([](const std::string& key) {
    json result = resultOfMesh();
    if (key == "robustness/3")
      result["faults"] = {"1 degenerate triangles", "closed, but inside out"};
    return key == "robustness/5" ? json{{"failed", "too few points"}} : result;
  });
  const Section section = robustness(bad);
  ASSERT_EQ(section.tables.size(), 2u);
  const Table& failures = section.tables[1];
  ASSERT_EQ(failures.rows.size(), 2u);
  EXPECT_EQ(failures.rows[0], (std::vector<json>{3, "1 degenerate triangles; closed, but inside out",
                                                 randomScan(good.options().seed, 3).commands()}));
  EXPECT_EQ(failures.rows[1].at(1), "too few points");
  EXPECT_EQ(section.tables[0].rows.back().at(2), 10);
}
