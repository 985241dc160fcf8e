// SPDX-License-Identifier: BSD-3-Clause
#include "real_clouds.h"

#include "evaluate/local_spacing.h"
#include "figure_support.h"
#include "objects.h"
#include "scan/random.h"
#include "scan/scan.h"
#include "support/errors.h"
#include "support/point_table.h"
#include "support/sensors.h"

#include <algorithm>
#include <filesystem>
#include <memory>

namespace mrf_apps {

namespace fs = std::filesystem;
using pcl::mrf::Execution;
using pcl::mrf::scan::Length;
using pcl::mrf::scan::Pattern;
using pcl::mrf::scan::Placement;
using pcl::mrf::scan::Points;
using pcl::mrf::scan::Random;
using pcl::mrf::scan::ScanOptions;
using Places = std::vector<Eigen::Vector3d>;

namespace {

constexpr int discCount = 16;
constexpr double smallestDisc = 5, largestDisc = 10; ///< radii, local spacings
constexpr double randomShare = .1;

/// Streams of the seed; a scan draws from the first ones.
enum Stream : std::uint64_t { choosingDiscs = 101, choosingPoints };

struct Ball {
  Eigen::Vector3d center;
  double radius;
};

std::vector<Ball> chooseDiscs(const Points& points, std::uint64_t seed, Execution& execution)
{
  const std::vector<double> spacings = LocalSpacing(points.positions, execution).spacings();
  if (spacings.empty())
    throw pcl::mrf::InvalidInput("too few points to withhold some");
  Random random(seed, choosingDiscs);
  std::vector<Ball> discs;
  // Small or crowded clouds have fewer.
  for (int tries = 0; tries < 1000 && discs.size() < static_cast<std::size_t>(discCount); ++tries) {
    const std::size_t i = random.index(points.size());
    const Ball ball{points.positions[i], spacings[i] * random.uniform(smallestDisc, largestDisc)};
    const auto isApart = [&](const Ball& other) {
      return (other.center - ball.center).norm() > other.radius + ball.radius;
    };
    if (std::all_of(discs.begin(), discs.end(), isApart))
      discs.push_back(ball);
  }
  return discs;
}

/// A view of all that was measured: from the only sensor, or the default one.
PictureOptions viewFromSensor(const RealCloud& cloud)
{
  SurfaceMesh points;
  points.vertices = cloud.input.positions;
  return cloud.sensors.size() == 1 ? pictureFrom(cloud.sensors.front(), points) : PictureOptions();
}

/// From a direction, in a frame with z up.
std::function<PictureOptions(const RealCloud&)> viewFrom(const Eigen::Vector3d& from)
{
  return [from](const RealCloud&) {
    PictureOptions options;
    options.from = from;
    options.up = Eigen::Vector3d::UnitZ();
    return options;
  };
}

RealCase lazy(const std::string& id, const std::string& title, bool hasOneSensor, std::function<RealCloud()> load,
              std::function<PictureOptions(const RealCloud&)> view = viewFromSensor)
{
  const auto cloud = std::make_shared<figures::Lazy<RealCloud>>(std::move(load));
  return {id, title, hasOneSensor, [cloud]() -> const RealCloud& { return (*cloud)(); }, std::move(view)};
}

RealCloud read(const fs::path& folder, std::uint64_t seed, Execution& execution)
{
  const auto path = [&](const char* name) { return (folder / name).string(); };
  const PointTable table = readPoints(path("input.ply"));
  if (table.normals.empty())
    throw pcl::mrf::InvalidInput("'" + path("input.ply") + "' has no normals");
  Points points;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (!table.positions[i].allFinite())
      continue;
    points.positions.push_back(table.positions[i]);
    points.normals.emplace_back(table.normals[i].cast<double>());
  }
  RealCloud cloud;
  if (fs::exists(path("heldout.ply")) && fs::exists(path("heldout_random.ply"))) {
    cloud.input = std::move(points);
    cloud.discs = readPoints(path("heldout.ply")).positions;
    cloud.random = readPoints(path("heldout_random.ply")).positions;
  } else
    cloud = withhold(points, points.positions, seed, execution);
  cloud.isWithheldNoisy = true;
  if (fs::exists(path("sensors.txt")))
    cloud.sensors = readSensors(path("sensors.txt"));
  return cloud;
}

/// A scanner's errors are along its rays, which for most points is nearly along the normal.
ScanOptions scannerOptions(const ExperimentOptions& options, std::int64_t points)
{
  ScanOptions result;
  result.sampling.pattern = Pattern::scanner;
  result.sampling.points = options.quick ? points / 5 : points;
  result.noise = {.2, Length::Unit::spacings};
  result.views.placement = Placement::front;
  result.views.count = 1;
  result.seed = options.seed;
  return result;
}

RealCase simulated(const std::string& id, const std::string& title,
                   std::function<const pcl::mrf::scan::Surface&()> surface, const ScanOptions& options,
                   Execution& execution, std::function<PictureOptions(const RealCloud&)> view = viewFromSensor)
{
  return lazy(
      id, title, options.sensors.size() == 1 || (options.sensors.empty() && options.views.count == 1),
      [surface = std::move(surface), options, &execution] {
        const pcl::mrf::scan::Scan scan = simulateScan(surface(), options, execution);
        RealCloud cloud = withhold(scan.cloud, scan.clean.positions, options.seed, execution);
        cloud.sensors = scan.sensors;
        return cloud;
      },
      std::move(view));
}

/// A shape of the catalog.
std::function<const pcl::mrf::scan::Surface&()> shape(const std::string& description)
{
  const auto object = std::make_shared<figures::Lazy<LoadedObject>>([=] { return loadShape(description); });
  return [object]() -> const pcl::mrf::scan::Surface& { return *(*object)().surface; };
}

} // namespace

pcl::mrf::Reconstruction reconstruct(const RealCloud& cloud, bool hasNormals, const pcl::mrf::Options& options,
                                     Execution& execution)
{
  pcl::mrf::RawCloud raw;
  raw.positions = figures::toFloat(cloud.input.positions);
  if (hasNormals)
    raw.normals = figures::toFloat(cloud.input.normals);
  if (cloud.sensors.size() == 1)
    raw.sensors = cloud.sensors;
  return pcl::mrf::reconstruct(std::move(raw), options, execution);
}

RealCloud withhold(const Points& points, const Places& truth, std::uint64_t seed, Execution& execution)
{
  const std::vector<Ball> discs = chooseDiscs(points, seed, execution);
  Random random(seed, choosingPoints);
  RealCloud cloud;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d& place = points.positions[i];
    const bool isInDisc = std::any_of(discs.begin(), discs.end(),
                                      [&](const Ball& disc) { return (place - disc.center).norm() < disc.radius; });
    // Drawn for every point: what becomes of one does not depend on the others.
    const bool isChosen = random.uniform() < randomShare;
    if (isInDisc)
      cloud.discs.push_back(truth[i]);
    else if (isChosen)
      cloud.random.push_back(truth[i]);
    else
      cloud.input.append(points, i);
  }
  return cloud;
}

std::vector<RealCase> measuredClouds(const ExperimentOptions& options, Execution& execution)
{
  std::vector<RealCase> cases;
  const fs::path all = fs::path(options.data) / "real";
  if (options.data.empty() || !fs::is_directory(all))
    return cases;
  std::vector<fs::path> folders;
  for (const fs::directory_entry& entry : fs::directory_iterator(all))
    if (fs::exists(entry.path() / "input.ply"))
      folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  for (const fs::path& folder : folders) {
    const std::string name = folder.filename().string();
    const fs::path sensors = folder / "sensors.txt";
    const bool hasOneSensor = fs::exists(sensors) && readSensors(sensors.string()).size() == 1;
    cases.push_back(lazy("data-" + name, name + " (--data)", hasOneSensor,
                         [folder, seed = options.seed, &execution] { return read(folder, seed, execution); }));
  }
  return cases;
}

std::vector<RealCase> simulatedClouds(const ExperimentOptions& options, Execution& execution)
{
  ScanOptions table = scannerOptions(options, 60000);
  table.views.distance = .7;
  table.views.elevation = 25;
  std::vector<RealCase> cases = {
      simulated("table", "objects on a table before a wall", shape("table"), table, execution)};
  if (options.quick)
    return cases;

  ScanOptions terrain = scannerOptions(options, 40000);
  terrain.sampling.aspect = 3;
  terrain.views.count = 3;
  terrain.views.distance = .8;
  terrain.views.fan = 60;
  cases.push_back(
      simulated("terrain", "terrain from three flights", shape("terrain"), terrain, execution, viewFrom({.4, -1, .9})));
  ScanOptions street = scannerOptions(options, 40000);
  street.sampling.aspect = 8;
  street.sampling.lowestElevation = -30;
  street.sampling.highestElevation = 30;
  street.views.axis = {0, 0, 1};
  street.views.forward = {1, 0, 0};
  street.sensors = {{0, 0, 1.8}};
  cases.push_back(
      simulated("street", "a street around a lidar", shape("street"), street, execution, viewFrom({-.5, -.6, .8})));
  std::vector<ScanObject> objects = scanObjects(options);
  objects.resize(std::min<std::size_t>(objects.size(), 3));
  for (const ScanObject& object : objects)
    cases.push_back(simulated(
        object.id + "-front", object.title + " from the front",
        [object]() -> const pcl::mrf::scan::Surface& { return *object.load().surface; }, scannerOptions(options, 30000),
        execution));
  return cases;
}

std::vector<RealCase> realClouds(const ExperimentOptions& options, Execution& execution)
{
  std::vector<RealCase> cases = measuredClouds(options, execution);
  for (RealCase& simulated : simulatedClouds(options, execution))
    cases.push_back(std::move(simulated));
  return cases;
}

} // namespace mrf_apps
