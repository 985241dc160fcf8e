// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.h"

#include "sigma_evaluation.h"
#include "support/errors.h"
#include "support/mesh_reader.h"
#include "support/output_files.h"
#include "support/point_table.h"
#include "support/report_json.h"
#include "support/text_file.h"
#include "support/tool_main.h"
#include "surface_distance.h"

#include <pcl/surface/mrf/exceptions.h>

#include <nlohmann/json.hpp>

#include <vtkColorTransferFunction.h>
#include <vtkNew.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace mrf_apps {
namespace {

void requireArea(const SurfaceMesh& mesh, const std::string& path)
{
  if (!(surfaceArea(mesh) > 0))
    throw FileError(path, "has no triangle with an area");
}

PointTable readCloud(const std::string& path)
{
  if (path.empty())
    return {};
  PointTable points = readPoints(path);
  for (const std::string& warning : points.warnings)
    std::fprintf(stderr, "warning: %s\n", escaped("'" + path + "': " + warning).c_str());
  if (finite(points.positions).empty())
    throw FileError(path, "has no finite point");
  return points;
}

/// Colors from blue over gray to red in steps that look equal; gray where the error is not finite.
std::vector<std::array<std::uint8_t, 3>> errorColors(const std::vector<float>& errors, double range)
{
  vtkNew<vtkColorTransferFunction> map;
  map->SetColorSpaceToDiverging();
  map->AddRGBPoint(0, .23, .30, .75);
  map->AddRGBPoint(range, .71, .02, .15);
  std::vector<std::array<std::uint8_t, 3>> colors;
  colors.reserve(errors.size());
  for (const float error : errors) {
    std::array<double, 3> rgb{.5, .5, .5};
    if (std::isfinite(error))
      map->GetColor(std::min(static_cast<double>(error), range), rgb.data());
    const auto byte = [](double share) { return static_cast<std::uint8_t>(std::lround(255 * share)); };
    colors.push_back({byte(rgb[0]), byte(rgb[1]), byte(rgb[2])});
  }
  return colors;
}

nlohmann::ordered_json filesOf(const EvaluateCommand& command)
{
  nlohmann::ordered_json files = {{"mesh", command.mesh}};
  const std::pair<const char*, const std::string&> others[] = {{"input", command.cloud},
                                                               {"heldOut", command.heldOut},
                                                               {"clean", command.clean},
                                                               {"reference", command.reference}};
  for (const auto& [name, path] : others)
    if (!path.empty())
      files[name] = path;
  return files;
}

/// Leaves no output behind if it throws.
int run(const EvaluateCommand& command)
{
  refuseInputAsOutput({command.mesh, command.cloud, command.heldOut, command.clean, command.reference},
                      {command.json, command.colored});
  OutputFiles outputs;
  for (const std::string& path : {command.json, command.colored})
    outputs.add(path);

  SurfaceMesh mesh = readMesh(command.mesh);
  if (command.merge)
    mesh = mergeVertices(mesh);
  requireArea(mesh, command.mesh);
  EvaluationInput input;
  PointTable cloud = readCloud(command.cloud);
  input.cloud = std::move(cloud.positions);
  input.cloudNormals = std::move(cloud.normals);
  input.heldOut = readCloud(command.heldOut).positions;
  input.clean = readCloud(command.clean).positions;
  if (!command.reference.empty()) {
    input.reference = readMesh(command.reference);
    requireArea(*input.reference, command.reference);
  }

  pcl::mrf::Execution execution(command.threads);
  const Evaluation evaluation = evaluate(mesh, input, command.options, execution);
  nlohmann::ordered_json json = toJson(evaluation);
  if (command.sigma)
    json["sigma"] =
        toJson(evaluateSigma(sigmaSamples(mesh, input, command.noise, execution), evaluation.options.diagonal));
  outputs.write(command.json, [&](const std::string& path) {
    nlohmann::ordered_json whole = {{"files", filesOf(command)}};
    whole.update(json);
    writeJson(path, whole);
  });
  if (!command.colored.empty()) {
    std::vector<float> errors = vertexErrors(mesh, input, execution);
    mesh.colors = errorColors(errors, evaluation.options.farLimit);
    mesh.scalars["error"] = std::move(errors);
    outputs.write(command.colored, [&](const std::string& path) { writeMesh(mesh, path, extension(command.colored)); });
  }
  outputs.publish();
  if (!command.quiet)
    std::fputs((escaped(command.mesh) + "\n" + toText(json)).c_str(), stdout);
  return exitDone;
}

} // namespace
} // namespace mrf_apps

int main(int argc, char** argv)
{
  return mrf_apps::toolMain("pcl_mrf_evaluate", "",
                            [&] { return mrf_apps::run(mrf_apps::parseEvaluateCommandLine(argc, argv)); });
}
