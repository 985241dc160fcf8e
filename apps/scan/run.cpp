// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.h"

#include "analytic_surface.h"
#include "mesh_surface.h"
#include "support/errors.h"
#include "support/mesh_reader.h"
#include "support/output_files.h"
#include "support/point_table.h"
#include "support/report_json.h"
#include "support/sensors.h"
#include "support/text_file.h"
#include "support/tool_main.h"

#include <pcl/surface/mrf/exceptions.h>

#include <nlohmann/json.hpp>

#include <cstdio>
#include <memory>
#include <sstream>

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

SurfaceMesh truthOf(const Surface& surface, const Vector3d& rotation)
{
  Triangles truth = surface.triangulate();
  SurfaceMesh mesh;
  for (const Vector3d& x : truth.vertices)
    mesh.vertices.push_back(rotate(rotation, x));
  mesh.triangles = std::move(truth.triangles);
  mesh.doublePrecision = true;
  return mesh;
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

std::string sensorsText(const Scan& scan)
{
  std::ostringstream text;
  text.precision(17);
  for (const Vector3d& x : scan.sensors)
    text << x.x() << ' ' << x.y() << ' ' << x.z() << '\n';
  return text.str();
}

std::string viewsText(const Scan& scan)
{
  std::string text;
  for (const std::int32_t view : scan.cloud.views)
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

void printSummary(const ScanCommand& command, const Scan& scan)
{
  std::printf("%s: %zu points", escaped(command.input).c_str(), scan.cloud.size());
  if (!scan.sensors.empty())
    std::printf(" from %zu sensor%s", scan.sensors.size(), scan.sensors.size() == 1 ? "" : "s");
  if (scan.outliers > 0)
    std::printf(", %lld of them outliers", static_cast<long long>(scan.outliers));
  if (!scan.holes.empty())
    std::printf(", %zu held out in %zu holes", scan.heldOut.size(), scan.holes.size());
  std::printf("; diagonal %.6g, mean spacing %.4g\n", scan.diagonal, scan.spacing);
}

/// Leaves no output behind if it throws.
int run(const ScanCommand& command)
{
  const std::vector<std::string> files = {command.output, command.views, command.sensors, command.heldOut,
                                          command.clean,  command.truth, command.report};
  refuseInputAsOutput({command.sensorsFile, isShape(command.input) ? "" : command.input}, files);
  refuseToReplace(Content::mesh, command.output);
  ScanOptions options = command.options;
  if (!command.sensorsFile.empty())
    options.sensors = parseSensors(command.sensorsFile, readWholeFile(command.sensorsFile));
  OutputFiles outputs;
  for (const std::string& path : files)
    outputs.add(path);

  const std::unique_ptr<Surface> surface = openSurface(command.input);
  pcl::mrf::Execution execution(command.threads);
  const Scan scan = simulateScan(*surface, options, execution);

  const auto writeCloud = [&](const std::string& path, const Points& points) {
    outputs.write(path, [&](const std::string& temporary) {
      writePoints(tableOf(points, command.hasNormals), temporary, extension(path));
    });
  };
  writeCloud(command.output, scan.cloud);
  writeCloud(command.clean, scan.clean);
  writeCloud(command.heldOut, scan.heldOut);
  outputs.write(command.truth, [&](const std::string& path) {
    writeMesh(truthOf(*surface, options.rotation), path, extension(command.truth));
  });
  outputs.write(command.views, [&](const std::string& path) { writeText(path, viewsText(scan)); });
  outputs.write(command.sensors, [&](const std::string& path) { writeText(path, sensorsText(scan)); });
  outputs.write(command.report, [&](const std::string& path) { writeJson(path, toJson(command, scan)); });
  outputs.publish();
  if (!command.quiet)
    printSummary(command, scan);
  return exitDone;
}

} // namespace
} // namespace mrf_apps

int main(int argc, char** argv)
{
  return mrf_apps::toolMain("pcl_mrf_scan", "ask for fewer --points",
                            [&] { return mrf_apps::run(mrf_apps::parseScanCommandLine(argc, argv)); });
}
