#include "command_line.h"

#include "support/errors.h"
#include "support/mesh_reader.h"
#include "support/parse.h"
#include "support/point_table.h"
#include "support/text_file.h"
#include "support/word_options.h"

#include <CLI/CLI.hpp>

namespace mrf_apps {
namespace {

void check(const EvaluateCommand& command)
{
  const auto require = [](bool condition, const std::string& message) {
    if (!condition)
      throw UsageError(message);
  };
  require(isReadableMesh(extension(command.mesh)),
          "MESH '" + command.mesh + "' does not end in " + meshInputExtensions);
  require(command.reference.empty() || isReadableMesh(extension(command.reference)),
          "--reference '" + command.reference + "' does not end in " + meshInputExtensions);
  require(command.json.empty() || extension(command.json) == "json",
          "--json '" + command.json + "' does not end in json");
  require(command.coloured.empty() || isMeshFormat(extension(command.coloured)),
          "--coloured '" + command.coloured + "' does not end in " + meshFileExtensions);
  require(command.coloured.empty() || extension(command.coloured) != "stl", "--coloured: STL files hold no colours");
  require(command.coloured.empty() || !command.reference.empty() || !command.cloud.empty() ||
              !command.heldOut.empty() || !command.clean.empty(),
          "--coloured needs something to compare with: --reference, --input, --clean or --held-out");
  validate(command.options);
}

} // namespace

EvaluateCommand parseEvaluateCommandLine(int argc, const char* const* argv)
{
  EvaluateCommand command;
  EvaluationOptions& options = command.options;
  CLI::App app("Measures a mesh: exact distances from points, distances to a reference surface, validity, shapes.",
               "pcl_mrf_evaluate");
  app.get_formatter()->column_width(30);
  app.footer(
      "Lengths are in the unit of MESH; the table gives them in % of the diagonal as well.\nExit status: 0 done, "
      "1 a file cannot be read or written or holds nothing to measure, 2 wrong usage, 3 the method failed.");
  app.add_option("MESH", command.mesh, std::string("what is measured: ") + meshInputExtensions)->required();
  WordOptions words(app);
  words.path(
      "--input", "CLOUD", command.cloud,
      std::string("points that were reconstructed (accuracy; figures in local spacings, and flipped normals if it "
                  "has any): ") +
          pointFileExtensions);
  words.path("--held-out", "CLOUD", command.heldOut, "points of the surface that were withheld (hole filling)");
  words.path("--clean", "CLOUD", command.clean, "the input without its noise");
  words.path("--reference", "MESH", command.reference, std::string("the true surface: ") + meshInputExtensions);
  app.add_flag(
      "--merge", command.merge,
      "take vertices of MESH with equal coordinates for one: for files that give every triangle its own corners");
  words.positive("--diagonal", "LENGTH", options.diagonal,
                 "what percentages refer to; default: of the bounding box of the reference, else the input, else MESH");
  words.positive("--far", "LENGTH", options.farLimit,
                 "surface farther from the other one is invented or missing; default 1 % of the diagonal");
  words.whole("--samples", options.samples, 1, 1e8,
              "on MESH and on the reference, uniform over the area, [1, 100000000]; default " +
                  std::to_string(options.samples));
  words.seed(options.seed, "of the samples; default " + std::to_string(options.seed));
  words.path("--json", "FILE.json", command.json, "all figures");
  words.path("--coloured", "FILE", command.coloured,
             "MESH coloured by its distance to the reference, else to the nearest known point, blue to red: "
             "ply, obj, vtk or vtp; all but obj with the field `error`");
  words.positive("--colour-range", "LENGTH", command.colourRange, "error that becomes red; default: as --far");
  words.threads(command.threads, "the result does not depend on it; default one per hardware thread");
  app.add_flag("-q,--quiet", command.quiet, "print errors only");
  app.set_help_flag("-h,--help", "print this help");

  command.information = parse(app, argc, argv, "pcl_mrf_evaluate " MRF_VERSION);
  if (!command.information.empty())
    return command;
  check(command);
  return command;
}

} // namespace mrf_apps
