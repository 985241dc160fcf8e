// SPDX-License-Identifier: BSD-3-Clause
#include "methods.h"

#include "evaluate/surface_samples.h"
#include "figure_support.h"
#include "hoppe.h"
#include "poisson.h"
#include "program.h"
#include "support/errors.h"
#include "support/mesh_reader.h"
#include "support/point_writer.h"

#include <pcl/surface/mrf/exceptions.h>

#include <limits>

namespace mrf_apps {

using pcl::mrf::Execution;
using pcl::mrf::InvalidInput;
using pcl::mrf::Options;
using pcl::mrf::scan::Points;

namespace {

constexpr int hoppeResolution = 128;

SurfaceMesh runOn(const std::string& path, const Points& points, int depth, const std::vector<std::string>& more)
{
  const TemporaryFolder folder;
  PointTable table;
  table.positions = points.positions;
  for (const Eigen::Vector3d& normal : points.normals)
    table.normals.push_back(normal.cast<float>());
  writePoints(table, folder.path("points.ply"), "ply");
  std::vector<std::string> command = {
      path, "--in", folder.path("points.ply"), "--out", folder.path("mesh.ply"), "--depth", std::to_string(depth)};
  command.insert(command.end(), more.begin(), more.end());
  runProgram(command);
  try {
    return readMesh(folder.path("mesh.ply"));
  } catch (const FileError& error) {
    throw InvalidInput("'" + path + "' left no mesh: " + error.what());
  }
}

} // namespace

Method ours(const std::string& id, const std::string& title, const Change& change)
{
  return {id, title, [change](const Points& points, double spacing, Execution& execution) {
            Options options;
            options.remesher.rounds = 0;
            change(options, spacing);
            return figures::toSurfaceMesh(figures::reconstruct(points.positions, points.normals, options, execution));
          }};
}

void solveExactly(Options& options, double)
{
  options.multiscale.denseVoxels = std::numeric_limits<std::int64_t>::max();
  options.solver.changeTolerance /= 200;
}

std::vector<Method> ownMethods()
{
  const auto withPrior = [](pcl::mrf::Prior prior) {
    return [prior](Options& options, double) { options.prior.kind = prior; };
  };
  return {ours("default", "this, k = 3 (default)", [](Options&, double) {}),
          ours("k2", "this, k = 2", withPrior(pcl::mrf::Prior::thinPlate)),
          ours("k1", "this, k = 1", withPrior(pcl::mrf::Prior::membrane)),
          ours("plane", "this, voxel-wise (plane)",
               [](Options& options, double) { options.observation.kind = pcl::mrf::ObservationKind::plane; }),
          ours("paper", "this, preset paper",
               [](Options& options, double) {
                 options = pcl::mrf::paperPreset();
                 options.normals.source = pcl::mrf::NormalSource::use; // those that all methods are given
                 options.remesher.rounds = 0;
               }),
          ours("fine", "this, --quality fine",
               [](Options& options, double) { options.multiscale.quality = pcl::mrf::Quality::fine; }),
          ours("exact", "this, all levels whole and exact", solveExactly)};
}

Method poissonMethod(int depth)
{
  return {"poisson", "pcl::Poisson, depth " + std::to_string(depth), [depth](const Points& points, double, Execution&) {
            return poisson(points.positions, points.normals, depth);
          }};
}

Method hoppeMethod()
{
  return {"hoppe", "pcl::MarchingCubesHoppe, 128³", [](const Points& points, double, Execution&) {
            return marchingCubesHoppe(points.positions, points.normals, hoppeResolution);
          }};
}

Method programMethod(const std::string& id, const std::string& title, const std::string& path, int depth,
                     const std::vector<std::string>& more)
{
  return {id, title, [=](const Points& points, double, Execution&) { return runOn(path, points, depth, more); }};
}

std::vector<Method> peerMethods()
{
  std::vector<Method> result = {poissonMethod(), hoppeMethod()};
  for (const char* name : {"PoissonRecon", "SSDRecon"}) {
    const std::string path = findProgram(name);
    if (!path.empty())
      result.push_back(programMethod(name, std::string(name) + ", depth 8", path));
  }
  return result;
}

MethodResult run(const Method& method, const Points& points, double spacing, Execution& execution)
{
  MethodResult result;
  const Stopwatch watch;
  result.mesh = method.run(points, spacing, execution);
  result.processorSeconds = watch.processorSeconds();
  if (!hasArea(result.mesh))
    throw InvalidInput("there is no surface");
  return result;
}

} // namespace mrf_apps
