// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.h"

#include "support/errors.h"
#include "support/mesh_reader.h"
#include "support/point_table.h"
#include "support/text_file.h"
#include "support/tool_options.h"

namespace mrf_apps {
namespace {

void check(const EvaluateCommand& command)
{
  const auto requireMesh = [&](const char* name, const std::string& path) {
    const std::string wrong = whyNotReadable(path);
    requireUsage(wrong.empty(), std::string(name) + " '" + path + "' " + wrong);
  };
  requireMesh("MESH", command.mesh);
  if (!command.reference.empty())
    requireMesh("--reference", command.reference);
  requireUsage(command.colored.empty() || isOneOf(extension(command.colored), meshFormats),
               "--colored '" + command.colored + "' does not end in " + alternatives(meshFormats));
  requireUsage(command.colored.empty() || extension(command.colored) != "stl", "--colored: STL files hold no colors");
  requireUsage(command.colored.empty() || !command.reference.empty() || !command.cloud.empty() ||
                   !command.heldOut.empty() || !command.clean.empty(),
               "--colored needs something to compare with: --reference, --input, --clean or --held-out");
  requireUsage(command.options.sensors.empty() || !command.reference.empty(), "--sensor needs a --reference");
  requireUsage(!command.options.sensors.empty() ||
                   (command.options.sensorAxis.isZero(0) && command.options.farGrowth == 0),
               "--sensor-axis and --far-growth need a --sensor");
  requireUsage(!command.sigma || unpackedExtension(command.mesh) == "ply",
               "--sigma: only of ply files is the field read");
  requireUsage(!command.sigma || !command.reference.empty() || !command.heldOut.empty() || !command.clean.empty(),
               "--sigma needs something to compare with: --reference, --held-out or --clean");
  requireUsage(!(command.noise > 0) || (command.sigma && command.reference.empty() && !command.heldOut.empty()),
               "--noise is of the points of --held-out, which --sigma looks at where there is no --reference");
}

} // namespace

EvaluateCommand parseEvaluateCommandLine(int argc, const char* const* argv)
{
  EvaluateCommand command;
  EvaluationOptions& options = command.options;
  ToolOptions parser("pcl_mrf_evaluate", MRF_VERSION,
                     "Measures a mesh: exact distances from points, distances to a reference surface, validity, "
                     "shapes.");
  parser.texts.usage = {"[OPTIONS] MESH"};
  std::vector<std::string> operands;
  parser.operands(operands, 1);
  parser.texts.operands = {{"MESH", "what is measured: " + meshInputExtensions}};

  parser.group("What is known");
  parser.file(
      "--input", "CLOUD", command.cloud,
      "points that were reconstructed (accuracy; figures in local spacings, and flipped normals if it has any): " +
          pointFileExtensions);
  parser.file("--held-out", "CLOUD", command.heldOut, "points of the surface that were withheld (hole filling)");
  parser.file("--clean", "CLOUD", command.clean, "the input without its noise");
  parser.file("--reference", "MESH", command.reference, "the true surface: " + meshInputExtensions);
  parser.vectors(
      "--sensor", options.sensors,
      "saw the reference from here: also tells what a sensor sees of MESH that is missing or in front of the "
      "reference, and normals and area where it saw surface; only near the points of --clean if they are "
      "given; may be repeated");
  parser.vector("--sensor-axis", options.sensorAxis,
                "where sensors look that are cameras: depth is along it, and shares are of their pixels");
  parser.group("How it is measured");
  parser.flag("--merge", command.merge,
              "take vertices of MESH with equal coordinates for one: for files that give every triangle its own "
              "corners");
  parser.flag("--sigma", command.sigma,
              "whether the field sigma of MESH, a ply file of pcl_mrf_reconstruction --uncertainty, is right: how many "
              "errors are within its 50, 80 and 95 % intervals, how wide these are, and how it ranks the errors, by "
              "--reference, else by --held-out and --clean");
  parser.positive("--noise", "LENGTH", command.noise,
                  "standard deviation of the points of --held-out along the normal, for --sigma: what has to hold them "
                  "is an interval of both; the report of a reconstruction has it; default: they are exact");
  parser.positive(
      "--diagonal", "LENGTH", options.diagonal,
      "what percentages refer to; default: of the bounding box of the reference, else the input, else MESH");
  parser.positive("--far", "LENGTH", options.farLimit,
                  "surface farther from the other one is invented or missing; default 1 % of the diagonal");
  parser.positive("--far-growth", "B", options.farGrowth,
                  "what is seen by --sensor may be farther by B times the square of its depth; default 0");
  parser.whole("--samples", options.samples, 1, 1e8,
               "on MESH and on the reference, uniform over the area, [1, 100000000]; default " +
                   std::to_string(options.samples));
  parser.seed(options.seed, "of the samples; default " + std::to_string(options.seed));
  parser.threads(command.threads, "the result does not depend on it; default one per hardware thread");
  parser.group("Output");
  parser.file("--json", "FILE.json", command.json, "all figures");
  parser.file("--colored", "FILE", command.colored,
              "MESH colored by its distance to the reference, else to the nearest known point, blue to red at --far: "
              "ply, obj, vtk or vtp; all but obj with the field `error`");
  parser.flag("-q,--quiet", command.quiet, "print errors only");

  parser.texts.everyday = {{"--input", "points that were reconstructed"},
                           {"--held-out", "points of the surface that were withheld"},
                           {"--clean", "the input without its noise"},
                           {"--reference", "the true surface"},
                           {"--sensor", "that saw the reference; repeatable"},
                           {"--far", "what is farther is invented or missing"},
                           {"--json", "all figures"},
                           {"--colored", "MESH colored by its error, blue to red"},
                           {"--help-all", "all other options"}};
  parser.texts.examples = {"mesh.ply --input scan.ply", "mesh.ply --input scan.ply --held-out rest.ply --json all.json",
                           "mesh.ply --reference truth.ply --colored error.vtk"};
  parser.texts.notes = {"Lengths are in the unit of MESH; the table gives them in % of the diagonal as well.",
                        "Exit status: 0 done, 1 a file cannot be read or written or holds nothing to measure, 2 wrong "
                        "usage, 3 the method failed."};

  parser.parse(argc, argv);
  if (operands.empty())
    throw UsageError("MESH is missing");
  command.mesh = operands.front();
  check(command);
  return command;
}

} // namespace mrf_apps
