// SPDX-License-Identifier: BSD-3-Clause
#include "run.h"

#include "analytic_surface.h"
#include "mesh_surface.h"
#include "support/errors.h"
#include "support/mesh_reader.h"
#include "support/output_files.h"
#include "support/point_writer.h"
#include "support/sensors.h"
#include "support/text_file.h"

#include <pcl/surface/mrf/exceptions.h>

#include <nlohmann/json.hpp>

#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <memory>

namespace mrf_apps {
namespace {

using namespace pcl::mrf::scan;
using Eigen::Vector3d;

std::unique_ptr<Surface> openSurface(const std::string& input)
{
  if (isShape(input))
    return std::make_unique<AnalyticSurface>(makeShape(input));
  SurfaceMesh mesh = readMesh(input);
  try {
    return std::make_unique<MeshSurface>(std::move(mesh.vertices), std::move(mesh.triangles));
  } catch (const pcl::mrf::InvalidInput& error) {
    throw FileError(input, error.message());
  }
}

PointTable tableOf(const Points& points, bool hasNormals)
{
  PointTable table;
  table.positions = points.positions;
  if (hasNormals)
    for (const Vector3d& normal : points.normals)
      table.normals.push_back(normal.cast<float>());
  return table;
}

Points ofView(const Points& points, std::int32_t view)
{
  Points result;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points.views[i] == view)
      result.append(points, i);
  return result;
}

/// scan.ply → scan-007.ply
std::string numbered(const std::string& path, std::size_t view)
{
  const std::filesystem::path whole(path);
  std::string digits = std::to_string(view);
  digits.insert(0, digits.size() < 3 ? 3 - digits.size() : 0, '0');
  return (whole.parent_path() / (whole.stem().string() + "-" + digits + whole.extension().string())).string();
}

std::string line(const Vector3d& x)
{
  char text[100];
  std::snprintf(text, sizeof text, "%.17g %.17g %.17g\n", x.x(), x.y(), x.z());
  return text;
}

std::string viewsText(const Points& points)
{
  std::string text;
  for (const std::int32_t view : points.views)
    text += std::to_string(view) + "\n";
  return text;
}

nlohmann::ordered_json toJson(const ScanCommand& command, const Scan& scan)
{
  const auto vector = [](const Vector3d& x) { return nlohmann::ordered_json{x.x(), x.y(), x.z()}; };
  nlohmann::ordered_json json = {{"input", command.input},
                                 {"seed", command.options.seed},
                                 {"points", scan.cloud.size()},
                                 {"inliers", scan.clean.size()},
                                 {"outliers", scan.outliers},
                                 {"heldOut", scan.heldOut.size()},
                                 {"views", scan.sensors.size()},
                                 {"diagonal", scan.diagonal},
                                 {"spacing", scan.spacing},
                                 {"visibleArea", scan.visibleArea},
                                 {"holes", nlohmann::ordered_json::array()}};
  for (const Hole& hole : scan.holes)
    json["holes"].push_back({{"center", vector(hole.center)}, {"radius", hole.radius}, {"points", hole.points}});
  return json;
}

/// Percentage on a terminal, nothing elsewhere.
class Progress {
public:
  explicit Progress(bool quiet) : isShown_(!quiet && isatty(STDERR_FILENO) != 0) {}
  ~Progress()
  {
    if (last_ >= 0)
      std::fputs("\r\033[K", stderr);
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  bool show(const std::string& stage, double fraction)
  {
    const int percent = static_cast<int>(100 * fraction);
    if (isShown_ && percent != last_) {
      std::fprintf(stderr, "\r\033[K%s %d %%", stage.c_str(), percent);
      std::fflush(stderr);
      last_ = percent;
    }
    return true;
  }

private:
  bool isShown_;
  int last_ = -1;
};

void printSummary(const ScanCommand& command, const Scan& scan)
{
  std::printf("%s: %zu points", command.input.c_str(), scan.cloud.size());
  if (!scan.sensors.empty())
    std::printf(" from %zu sensors", scan.sensors.size());
  if (scan.outliers > 0)
    std::printf(", %lld of them outliers", static_cast<long long>(scan.outliers));
  if (!scan.holes.empty())
    std::printf(", %zu held out in %zu holes", scan.heldOut.size(), scan.holes.size());
  std::printf("; diagonal %.6g, mean spacing %.4g\n", scan.diagonal, scan.spacing);
}

} // namespace

void run(const ScanCommand& command)
{
  const bool isFile = !isShape(command.input);
  std::vector<std::string> inputs = {command.sensorsFile};
  if (isFile)
    inputs.push_back(command.input);
  refuseInputAsOutput(inputs, {command.output, command.views, command.sensors, command.heldOut, command.clean,
                               command.eachView, command.report});
  ScanOptions options = command.options;
  if (!command.sensorsFile.empty())
    options.sensors = readSensors(command.sensorsFile);

  OutputFiles outputs;
  for (const std::string& path :
       {command.output, command.views, command.sensors, command.heldOut, command.clean, command.report})
    if (!path.empty())
      outputs.add(path);
  const std::size_t sensors =
      options.sensors.empty() ? static_cast<std::size_t>(options.views.count) : options.sensors.size();
  if (!command.eachView.empty())
    for (std::size_t view = 0; view < sensors; ++view)
      outputs.add(numbered(command.eachView, view));

  const std::unique_ptr<Surface> surface = openSurface(command.input);
  Scan scan;
  {
    Progress progress(command.quiet);
    pcl::mrf::Execution execution(
        command.threads, [&](const std::string& stage, double fraction) { return progress.show(stage, fraction); });
    scan = simulateScan(*surface, options, execution);
  }

  const auto write = [&](const std::string& path, const std::function<void(const std::string&)>& writer) {
    if (!path.empty())
      outputs.write(path, writer);
  };
  const auto writeCloud = [&](const std::string& path, const Points& points) {
    write(path, [&](const std::string& temporary) {
      writePoints(tableOf(points, command.hasNormals), temporary, extension(path));
    });
  };
  writeCloud(command.output, scan.cloud);
  writeCloud(command.clean, scan.clean);
  writeCloud(command.heldOut, scan.heldOut);
  if (!command.eachView.empty())
    for (std::size_t view = 0; view < sensors; ++view)
      writeCloud(numbered(command.eachView, view), ofView(scan.cloud, static_cast<std::int32_t>(view)));
  write(command.views, [&](const std::string& path) { writeText(path, viewsText(scan.cloud)); });
  write(command.sensors, [&](const std::string& path) {
    std::string text;
    for (const Vector3d& sensor : scan.sensors)
      text += line(sensor);
    writeText(path, text);
  });
  write(command.report, [&](const std::string& path) {
    writeText(path, toJson(command, scan).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  });
  outputs.publish();
  if (!command.quiet)
    printSummary(command, scan);
}

} // namespace mrf_apps
