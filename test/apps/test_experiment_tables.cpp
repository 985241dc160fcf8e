// SPDX-License-Identifier: BSD-3-Clause
// Table 1 and the defaults: the tables made of known results, PCL's marching cubes on equal terms, the generated
// objects.
#include "evaluate/surface_distance.h"
#include "experiments/comparisons.h"
#include "experiments/hoppe.h"
#include "experiments/patches.h"
#include "experiments/real_bars.h"
#include "experiments/real_clouds.h"
#include "experiments/wavy_shapes.h"
#include "support/laboratory.h"
#include "support/tool.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <shapes/signed_distance.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <set>

using namespace mrf_apps;
using Eigen::Vector3d;
using mrf_test::MadeUp;
using mrf_test::MeasuresOne;
using nlohmann::json;

namespace {

pcl::mrf::MeshStatistics statisticsOf(const SurfaceMesh& mesh)
{
  pcl::mrf::TriangleMesh plain;
  for (const Vector3d& vertex : mesh.vertices)
    plain.vertices.push_back(vertex.cast<float>());
  plain.triangles = mesh.triangles;
  return pcl::mrf::measure(plain);
}

json patches(const std::vector<json>& holes)
{
  return {{"accuracy", .25},    {"holes", holes}, {"invented", 3},        {"components", 1},
          {"boundaryLoops", 0}, {"flaws", 0},     {"processorSeconds", 2}};
}

std::string methodOf(const std::string& key)
{
  return key.substr(key.rfind('/') + 1);
}

/// The cell of the only row that starts with these cells.
json cell(const Table& table, const std::vector<json>& start, const std::string& column)
{
  const auto at = std::find(table.columns.begin(), table.columns.end(), column) - table.columns.begin();
  json found;
  for (const auto& row : table.rows)
    if (static_cast<std::ptrdiff_t>(row.size()) > at && std::equal(start.begin(), start.end(), row.begin())) {
      EXPECT_TRUE(found.is_null());
      found = row[static_cast<std::size_t>(at)];
    }
  return found;
}

} // namespace

TEST(Tables, AreWellFormedIfEverythingFails)
{
  for (const auto& make : {table1, defaults}) {
    MadeUp laboratory([](const std::string&) { return json{{"failed", "out of order"}}; });
    const Section section = make(laboratory);
    SCOPED_TRACE(section.id);
    EXPECT_FALSE(laboratory.keys.empty());
    for (const Table& table : section.tables) {
      EXPECT_FALSE(table.rows.empty());
      for (const auto& row : table.rows)
        EXPECT_EQ(row.size(), table.columns.size());
    }
    for (const auto& row : section.tables.front().rows)
      EXPECT_EQ(row[2], row[3]) << "every scan failed";
  }
}

TEST(Tables, OfKnownErrors)
{
  // The first hole is one that says too little; a method that is twice, or half, as far off in every hole.
  MadeUp laboratory([](const std::string& key) {
    const std::string method = methodOf(key);
    const double factor = method == "k2" ? 2 : method == "plane" ? .5 : 1;
    if (method == "poisson" && key.find("bunny") == std::string::npos)
      return json{{"failed", "out of order"}};
    return patches({json(), factor * .1, factor * .2, factor * .6});
  });
  const Section section = table1(laboratory);
  const Table &summary = section.tables.at(0), &paired = section.tables.at(1);
  const std::string ours = summary.rows.front()[1];
  const std::vector<json> all = {"all", ours};
  EXPECT_DOUBLE_EQ(cell(summary, all, "hole RMS, median"), .2);
  EXPECT_DOUBLE_EQ(cell(summary, all, "hole RMS, mean"), .3);
  EXPECT_DOUBLE_EQ(cell(summary, all, "hole RMS, worst"), .6);
  EXPECT_DOUBLE_EQ(cell(summary, all, "accuracy RMS, median"), .25);
  EXPECT_EQ(cell(summary, all, "holes").get<int>(), 3 * cell(summary, all, "scans").get<int>());
  EXPECT_EQ(cell(summary, all, "CPU s, median"), 2);

  const char* const ratio = "median of its error / ours";
  const char* const share = "better than ours in % of the holes";
  for (const auto& [method, expected] : {std::pair("this, k = 2", 2.), {"this, voxel-wise (plane)", .5}}) {
    SCOPED_TRACE(method);
    EXPECT_DOUBLE_EQ(cell(paired, {method}, ratio), expected);
    EXPECT_DOUBLE_EQ(cell(paired, {method}, "95 % from"), expected) << "no spread";
    EXPECT_DOUBLE_EQ(cell(paired, {method}, "to"), expected);
    EXPECT_DOUBLE_EQ(cell(paired, {method}, share), expected < 1 ? 100 : 0);
  }
  // The paper's other method has a row that says why it is empty.
  const auto isMissing = [](const std::vector<json>& row) {
    return row[1].get<std::string>().rfind("MPU: not measured, as", 0) == 0 && row[2].is_null();
  };
  EXPECT_EQ(std::count_if(summary.rows.begin(), summary.rows.end(), isMissing), 1);
  // What fails is counted, and leaves the others' holes as they are.
  EXPECT_GE(cell(summary, {"all", "pcl::Poisson, depth 8"}, "failed"), 1);
  EXPECT_EQ(cell(summary, all, "failed"), 0);

  for (const Curve& curve : section.plots.at(0).curves) {
    EXPECT_TRUE(std::is_sorted(curve.x.begin(), curve.x.end()));
    EXPECT_TRUE(std::is_sorted(curve.y.begin(), curve.y.end()));
    EXPECT_EQ(curve.x.size(), curve.y.size());
    EXPECT_LT(curve.x.back(), 100);
  }
}

namespace {

/// A scan's error bars: of how much of the area the 95 % interval holds the error.
json bars(double held)
{
  const json statistics = {
      {"vertices", 100}, {"coverage", {.5, .75, held}}, {"rms", .2}, {"halfWidth", .5}, {"likelihood", -5}};
  return {{"measured", statistics},
          {"fillings", json()},
          {"near", statistics},
          {"rim", json()},
          {"far", json()},
          {"farthest", json()},
          {"sigma", {{"sparsification", .1}, {"rank", .5}}},
          {"confidence", {{"sparsification", .2}, {"rank", .25}}},
          {"density", {{"sparsification", .3}, {"rank", .125}}}};
}

/// A real cloud's: discs are not held as often, and there is no surface near a quarter of their points.
json realBarsOf(double held)
{
  const auto statistics = [](double share, double lost) {
    return json{{"vertices", 60},
                {"lost", lost},
                {"coverage", {.5, .75, share}},
                {"rms", .5},
                {"halfWidth", 1.},
                {"likelihood", 2},
                {"sigma", {{"sparsification", .125}, {"rank", .5}}},
                {"confidence", {{"sparsification", .25}, {"rank", .25}}}};
  };
  return {{"noise", .0625}, {"random", statistics(held, 0)}, {"discs", statistics(held / 2, .25)}, {"all", json()}};
}

json barsOfKey(const std::string& key)
{
  return key.rfind("uncertainty/real/", 0) == 0 ? realBarsOf(.875) : bars(1);
}

} // namespace

TEST(ErrorBars, AreCountedByObject)
{
  MadeUp laboratory([](const std::string& key) {
    return key.find("/real/") == std::string::npos ? bars(key.find("bunny") == std::string::npos ? .75 : 1)
                                                   : barsOfKey(key);
  });
  const Section section = errorBars(laboratory);
  const Table &coverage = section.tables.at(0), &objects = section.tables.at(1), &ranking = section.tables.at(2);
  const std::vector<json> measured = {"clean", "measured surface"};
  EXPECT_DOUBLE_EQ(cell(coverage, measured, "50 %"), 50);
  EXPECT_DOUBLE_EQ(cell(coverage, measured, "80 %"), 75);
  EXPECT_DOUBLE_EQ(cell(coverage, measured, "worst object"), 75);
  EXPECT_DOUBLE_EQ(cell(coverage, measured, "median half-width of 95 % / RMS error"), 2.5);
  // Objects count the same, and the interval over two of them is as wide as they are apart.
  const bool hasBunny = std::any_of(objects.rows.begin(), objects.rows.end(), [](const std::vector<json>& row) {
    return row[1].get<std::string>().find("bunny") != std::string::npos;
  });
  EXPECT_DOUBLE_EQ(cell(coverage, measured, "95 %"), hasBunny ? 87.5 : 75);
  EXPECT_DOUBLE_EQ(cell(coverage, measured, "95 % from"), 75);
  EXPECT_DOUBLE_EQ(cell(coverage, measured, "to"), hasBunny ? 100 : 75);
  EXPECT_TRUE(cell(coverage, {"noisy", "fillings"}, "95 %").is_null()) << "there are none";
  EXPECT_DOUBLE_EQ(cell(ranking, {"clean", "sigma"}, "sparsification"), .1);
  EXPECT_DOUBLE_EQ(cell(ranking, {"noisy", "our confidence"}, "rank correlation"), .25);
  for (const Table& table : section.tables)
    for (const auto& row : table.rows)
      EXPECT_EQ(row.size(), table.columns.size()) << table.name;
}

TEST(ErrorBars, OfRealCloudsAreShownByCloud)
{
  MadeUp laboratory(barsOfKey);
  const Section section = errorBars(laboratory);
  EXPECT_EQ(laboratory.keys.count("uncertainty/real/table"), 1u) << "without --data there is a simulated one";
  const Table& table = section.tables.back();
  EXPECT_EQ(table.rows.size(), 3u);
  const json cloud = table.rows.front()[0];
  const auto at = [&](const char* withheld, const char* column) { return cell(table, {cloud, withheld}, column); };
  EXPECT_EQ(at("random tenth", "95 %"), 87.5);
  EXPECT_EQ(at("random tenth", "noise, spacings"), .0625);
  EXPECT_EQ(at("random tenth", "median half-width of 95 % / RMS"), 2);
  EXPECT_EQ(at("random tenth", "likelihood"), 2);
  EXPECT_EQ(at("random tenth", "without surface, %"), 0);
  EXPECT_EQ(at("discs", "95 %"), 43.8);
  EXPECT_EQ(at("discs", "without surface, %"), 25);
  EXPECT_EQ(at("discs", "sparsification by sigma"), .125);
  EXPECT_EQ(at("discs", "by confidence"), .25);
  EXPECT_TRUE(at("both", "95 %").is_null()) << "nothing was withheld";
  for (const auto& row : table.rows)
    EXPECT_EQ(row.size(), table.columns.size());
}

TEST(ErrorBars, AreWellFormedIfEverythingFails)
{
  MadeUp laboratory([](const std::string&) { return json{{"failed", "out of order"}}; });
  const Section section = errorBars(laboratory);
  EXPECT_FALSE(laboratory.keys.empty());
  for (const Table& table : section.tables) {
    EXPECT_FALSE(table.rows.empty());
    for (const auto& row : table.rows)
      EXPECT_EQ(row.size(), table.columns.size()) << table.name;
  }
}

TEST(ErrorBars, AreMeasuredOnAScan)
{
  // One scan, as --quick makes it.
  MeasuresOne laboratory("", barsOfKey);
  errorBars(laboratory);
  ASSERT_FALSE(laboratory.measured.is_null());
  for (const char* place : {"measured", "fillings", "near", "rim"}) {
    const json& statistics = laboratory.measured.at(place);
    ASSERT_FALSE(statistics.is_null()) << place;
    EXPECT_GT(statistics.at("vertices"), 0);
    EXPECT_GE(statistics.at("/coverage/2"_json_pointer), statistics.at("/coverage/0"_json_pointer));
    EXPECT_GT(statistics.at("halfWidth"), 0);
  }
  EXPECT_EQ(laboratory.measured.at("/measured/vertices"_json_pointer).get<int>() +
                laboratory.measured.at("/fillings/vertices"_json_pointer).get<int>(),
            [&] {
              int sum = 0;
              for (const char* bin : {"near", "rim", "far", "farthest"})
                if (!laboratory.measured.at(bin).is_null())
                  sum += laboratory.measured.at(bin).at("vertices").get<int>();
              return sum;
            }())
      << "each vertex is in one bin";
  EXPECT_GT(laboratory.measured.at("/sigma/rank"_json_pointer), .2) << "where sigma is large, so are errors";
  EXPECT_LT(laboratory.measured.at("/sigma/sparsification"_json_pointer),
            laboratory.measured.at("/confidence/sparsification"_json_pointer));
}

TEST(ErrorBars, AreMeasuredOnARealCloud)
{
  MeasuresOne laboratory("uncertainty/real/table", barsOfKey);
  errorBars(laboratory);
  const json& result = laboratory.measured;
  ASSERT_FALSE(result.is_null());
  for (const char* place : {"random", "discs", "all"}) {
    SCOPED_TRACE(place);
    const json& statistics = result.at(place);
    EXPECT_LE(statistics.at("/coverage/0"_json_pointer), statistics.at("/coverage/1"_json_pointer));
    EXPECT_LE(statistics.at("/coverage/1"_json_pointer), statistics.at("/coverage/2"_json_pointer));
    // Objects on a table have edges that neither voxels nor noise let anybody see: not all of it is held.
    EXPECT_GT(statistics.at("/coverage/2"_json_pointer), .7);
    EXPECT_GT(statistics.at("halfWidth"), 0);
    EXPECT_LT(statistics.at("lost"), .1) << "a table before a wall is reconstructed";
    EXPECT_GT(statistics.at("/sigma/rank"_json_pointer), 0) << "where sigma is large, so are errors";
  }
  EXPECT_EQ(result.at("/random/vertices"_json_pointer).get<int>() +
                result.at("/discs/vertices"_json_pointer).get<int>(),
            result.at("/all/vertices"_json_pointer));
  EXPECT_LT(result.at("/random/halfWidth"_json_pointer), result.at("/discs/halfWidth"_json_pointer))
      << "without points the surface is less certain";
}

namespace {

/// A folder for --data.
class BarsOfAFolder : public tool::Test {
protected:
  static constexpr double noise = .1; ///< of the rows

  /// Rows of points of a lattice with a spacing of 1 in a plane, with noise across it, that are chosen.
  static std::string planeRows(const std::function<bool(int x, int y)>& isChosen, bool hasNormals)
  {
    constexpr int side = 60;
    std::mt19937 random(3);
    std::normal_distribution<double> normal(0, noise);
    std::string rows;
    for (int i = 0; i < side * side; ++i) {
      const double height = normal(random);
      if (isChosen(i % side, i / side))
        rows += std::to_string(i % side) + " " + std::to_string(i / side) + " " + std::to_string(height) +
                (hasNormals ? " 0 0 1\n" : "\n");
    }
    return rows;
  }
};

} // namespace

TEST_F(BarsOfAFolder, HoldPointsWithTheirNoise)
{
  const auto isTenth = [](int x, int y) { return (7 * x + 3 * y) % 10 == 0; };
  const auto isDisc = [](int x, int y) { return (x - 30) * (x - 30) + (y - 30) * (y - 30) < 9; };
  const std::filesystem::path folder = path("real") / "plane";
  std::filesystem::create_directories(folder);
  const std::string tenth = planeRows([&](int x, int y) { return isTenth(x, y) && !isDisc(x, y); }, false);
  tool::writeText(folder / "input.ply",
                  tool::asciiPly(planeRows([&](int x, int y) { return !isTenth(x, y) && !isDisc(x, y); }, true), true));
  tool::writeText(folder / "heldout_random.ply", tool::asciiPly(tenth, false));
  // One of them is nowhere near a surface.
  const std::string disc = planeRows(isDisc, false) + "30 30 50\n";
  tool::writeText(folder / "heldout.ply", tool::asciiPly(disc, false));

  MeasuresOne laboratory("uncertainty/real/data-plane", barsOfKey);
  laboratory.settings.data = path("").string();
  realBars(laboratory);
  const json& result = laboratory.measured;
  ASSERT_FALSE(result.is_null());
  // The local spacing of a lattice is .313 √2; a hundred pairs tell the noise to about 10 %.
  EXPECT_NEAR(result.at("noise").get<double>(), noise / (.313 * std::sqrt(2)), .3 * noise / .44);
  // Binomial: σ = √(.95 · .05 / 360) = .011. The plane's own sigma is a third of the noise and would hold half of them.
  EXPECT_GT(result.at("/random/coverage/2"_json_pointer), .9);
  EXPECT_LT(result.at("/random/coverage/0"_json_pointer), .7) << "nor are they wide for nothing";
  const auto lines = [](const std::string& text) {
    return static_cast<double>(std::count(text.begin(), text.end(), '\n'));
  };
  EXPECT_EQ(result.at("/random/vertices"_json_pointer), lines(tenth));
  EXPECT_EQ(result.at("/random/lost"_json_pointer), 0);
  EXPECT_EQ(result.at("/discs/vertices"_json_pointer), lines(disc) - 1);
  EXPECT_DOUBLE_EQ(result.at("/discs/lost"_json_pointer), 1 / lines(disc));
}

TEST(Tables, DefaultsAreComparedHoleByHole)
{
  // Opposite orders: the ratios' median is not the ratio of the medians.
  MadeUp laboratory([](const std::string& key) {
    return methodOf(key) == "k=2" ? patches({.4, .4, .1}) : patches({.1, .2, .4});
  });
  const Section section = defaults(laboratory);
  const Table& table = section.tables.at(0);
  const char* const ratio = "hole by hole: median of its error / default's";
  EXPECT_DOUBLE_EQ(cell(table, {"k", "2"}, ratio), 2);
  EXPECT_DOUBLE_EQ(cell(table, {"k", "1"}, ratio), 1);
  EXPECT_DOUBLE_EQ(cell(table, {"k", "2"}, "hole RMS, median"), .4);
}

TEST(Tables, SamplingsAreKeptApart)
{
  MadeUp laboratory([](const std::string&) { return patches({.1, .2}); });
  table1(laboratory);
  const std::set<std::string> ofEven = laboratory.keys;
  laboratory.keys.clear();
  laboratory.settings.sampling = pcl::mrf::scan::Pattern::random;
  const Section section = table1(laboratory);
  defaults(laboratory);
  for (const std::string& key : laboratory.keys) {
    EXPECT_EQ(ofEven.count(key), 0u) << key;
    EXPECT_NE(key.find("-random/"), std::string::npos) << key;
  }
  EXPECT_NE(section.paragraphs.at(1).find("random sampling"), std::string::npos);
}

TEST(Patches, SpacingMeansTheSameForAnySampling)
{
  MadeUp laboratory([](const std::string&) { return json(); });
  const PatchScan patchScan{scanObjects(laboratory.options()).back(), 0};
  const pcl::mrf::scan::Scan even = simulate(patchScan, laboratory);
  for (const auto pattern : {pcl::mrf::scan::Pattern::random, pcl::mrf::scan::Pattern::scanner}) {
    laboratory.settings.sampling = pattern;
    const pcl::mrf::scan::Scan other = simulate(patchScan, laboratory);
    // The scanner gives 2 % more or fewer points; the visible area is known to about as much.
    EXPECT_NEAR(other.spacing / even.spacing, 1, .04);
    EXPECT_NE(other.cloud.positions, even.cloud.positions);
  }
}

TEST(RealTable, OfKnownFigures)
{
  MadeUp laboratory([](const std::string& key) {
    if (methodOf(key) == "poisson")
      return json{{"failed", "out of order"}};
    return json{{"points", 1000},   {"unevenness", 3},   {"discs", .5},          {"random", .25},
                {"input", .125},    {"near", .99875},    {"invented", .02},      {"flipped", json()},
                {"dropped", .0125}, {"triangles", 5000}, {"processorSeconds", 2}};
  });
  const Table table = real(laboratory).tables.at(0);
  for (const char* method : {"default", "estimated", "poisson"})
    EXPECT_EQ(laboratory.keys.count(std::string("real/table/") + method), 1u) << method;
  for (const auto& row : table.rows)
    EXPECT_EQ(row.size(), table.columns.size());
  const std::vector<json> ours(table.rows.front().begin(), table.rows.front().begin() + 2);
  EXPECT_EQ(cell(table, ours, "discs RMS"), .5);
  EXPECT_EQ(cell(table, ours, "random RMS"), .25);
  EXPECT_EQ(cell(table, ours, "near %"), 99.875) << "all of the digits that count";
  EXPECT_EQ(cell(table, ours, "invented %"), 2);
  EXPECT_EQ(cell(table, ours, "dropped %"), 1.25);
  EXPECT_TRUE(cell(table, ours, "flipped %").is_null());
  EXPECT_EQ(cell(table, {ours[0], "pcl::Poisson, depth 9"}, "discs RMS"), "out of order");
}

TEST(RealClouds, WithheldPointsAreTheTruthAndNothingIsLost)
{
  // Two lattices, one ten times as coarse; what is true lies one unit above what was measured.
  constexpr int side = 120;
  pcl::mrf::scan::Points points;
  std::vector<Vector3d> truth;
  for (const double spacing : {1., 10.})
    for (int i = 0; i < side * side; ++i) {
      points.positions.emplace_back(spacing * (i % side) + (spacing > 1 ? 200 : 0), spacing * (i / side), 0);
      points.normals.emplace_back(0, 0, 1);
      truth.push_back(points.positions.back() + Vector3d::UnitZ());
    }
  pcl::mrf::Execution execution(2);
  const RealCloud cloud = withhold(points, truth, 1, execution);
  EXPECT_EQ(cloud.input.size() + cloud.discs.size() + cloud.random.size(), points.size());
  EXPECT_EQ(cloud.input.normals.size(), cloud.input.size());
  // Binomial: σ = √(28800 · .1 · .9) = 51; the discs take at most two per cent away.
  EXPECT_NEAR(static_cast<double>(cloud.random.size()), 2880, 4 * 51 + 58);
  // A ball of 5 to 10 spacings of .44 sides holds 15 to 62 points, of both lattices alike; at a border half as many.
  EXPECT_GT(cloud.discs.size(), 16u * 8);
  EXPECT_LT(cloud.discs.size(), 16u * 62);
  std::size_t coarse = 0;
  for (const std::vector<Vector3d>* withheld : {&cloud.discs, &cloud.random})
    for (const Vector3d& place : *withheld)
      ASSERT_EQ(place.z(), 1);
  for (const Vector3d& place : cloud.discs)
    coarse += place.x() >= 200 ? 1 : 0;
  // Each disc is in either with equal chances: fewer than two of sixteen has a chance of .0003.
  EXPECT_GT(coarse, 2u * 8);
  EXPECT_LT(coarse, 14u * 62);
  const RealCloud other = withhold(points, truth, 2, execution);
  EXPECT_NE(other.discs, cloud.discs);
  points.positions.resize(5);
  EXPECT_THROW(withhold(points, truth, 1, execution), pcl::mrf::InvalidInput);
}

TEST(MergeClose, JoinsCopiesAndNothingElse)
{
  // Two triangles with an edge in common, whose corners were computed twice; cells of any size have borders between
  // the copies for some of the shifts.
  for (int shift = -40; shift <= 40; ++shift) {
    SCOPED_TRACE(shift);
    const Vector3d at = Vector3d::Constant(.00025 * shift);
    SurfaceMesh mesh;
    mesh.vertices = {at + Vector3d(0, 0, 0),        at + Vector3d(1, 0, 0),       at + Vector3d(0, 1, 0),
                     at + Vector3d(1 + 4e-4, 0, 0), at + Vector3d(1, 1, 0),       at + Vector3d(-4e-4, 1, -4e-4),
                     at + Vector3d(0, 0, .01),      at + Vector3d(.0005, 0, .01), at + Vector3d(0, 2, 0)};
    // The last one is thinner than the distance: it collapses.
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}};
    const SurfaceMesh merged = mergeClose(mesh, .001);
    EXPECT_EQ(merged.vertices.size(), 6u);
    ASSERT_EQ(merged.triangles.size(), 2u);
    EXPECT_EQ(statisticsOf(merged).components, 1);
    for (const Vector3d& vertex : merged.vertices)
      EXPECT_NE(std::find(mesh.vertices.begin(), mesh.vertices.end(), vertex), mesh.vertices.end());
  }
}

TEST(Hoppe, HasTheSidesThatLieInThePointsBox)
{
  // A cube with sides of 2: all its points lie in their box.
  constexpr int side = 40;
  std::vector<Vector3d> positions, normals;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1., 1.})
      for (int i = 0; i < side; ++i)
        for (int j = 0; j < side; ++j) {
          Vector3d place;
          place[axis] = sign;
          place[(axis + 1) % 3] = (2. * i + 1) / side - 1;
          place[(axis + 2) % 3] = (2. * j + 1) / side - 1;
          positions.push_back(place);
          normals.push_back(sign * Vector3d::Unit(axis));
        }
  // PCL uses neither the outermost cells nor the last place along an axis: 5 % have to be a few cells.
  constexpr int resolution = 96;
  const SurfaceMesh mesh = marchingCubesHoppe(positions, normals, resolution);
  pcl::mrf::Execution execution(2);
  for (const double distance : SurfaceDistance(mesh).distances(positions, execution))
    // Linear between the grid's places from the tangent planes, which are exact here: only edges are cut.
    ASSERT_LT(distance, 2.2 / resolution);
  const pcl::mrf::MeshStatistics statistics = statisticsOf(mesh);
  EXPECT_EQ(statistics.components, 1) << "corners are shared";
  EXPECT_EQ(statistics.boundaryEdges, 0);
  EXPECT_NEAR(std::abs(statistics.volume), 8, .1) << "edges are cut by less than a cell";
}

TEST(WavyShapes, AreClosedAndWavy)
{
  pcl::mrf::Execution execution(2);
  struct Expected {
    SurfaceMesh mesh;
    shapes::Sdf plain;
    std::int64_t euler;
  };
  for (const Expected& shape : {Expected{wavyTorus(execution), shapes::torus(1, .42), 0},
                                Expected{wavyBox(execution), shapes::box({1, .75, .5}, .2), 2}}) {
    SCOPED_TRACE(shape.euler);
    const pcl::mrf::MeshStatistics statistics = statisticsOf(shape.mesh);
    EXPECT_EQ(statistics.components, 1);
    EXPECT_TRUE(statistics.closed());
    EXPECT_TRUE(statistics.manifold());
    EXPECT_EQ(statistics.eulerCharacteristic, shape.euler);
    EXPECT_GT(statistics.volume, 0) << "triangles face outward";
    EXPECT_GT(statistics.triangles, 50000) << "finer than what is scanned";
    double lowest = 0, highest = 0;
    for (const Vector3d& vertex : shape.mesh.vertices) {
      lowest = std::min(lowest, shape.plain(vertex));
      highest = std::max(highest, shape.plain(vertex));
    }
    // The product of three waves reaches ±1 nearly; a linear crossing is off by far less than a hundredth of a wave.
    for (const double height : {-lowest, highest}) {
      EXPECT_LE(height, 1.01 * waveHeight);
      EXPECT_GE(height, .6 * waveHeight);
    }
  }
}
