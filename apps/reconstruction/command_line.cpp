// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.h"
#include "support/errors.h"
#include "support/option_text.h"
#include "support/picture.h"
#include "support/point_table.h"
#include "support/surface_mesh.h"
#include "support/text_file.h"
#include "support/tool_options.h"

#include <pcl/surface/mrf/option_table.h>

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <set>

namespace mrf_apps {
namespace {

using pcl::mrf::OptionDeclaration;
using pcl::mrf::Options;

/// Registers options of the library's table. They are set in the order of registration. The preset is registered first,
/// so that all other options change it, wherever it is given.
class OptionParser : public ToolOptions {
public:
  explicit OptionParser(Options& options)
      : ToolOptions("pcl_mrf_reconstruction", MRF_VERSION,
                    "Reconstructs a surface from points by a Markov random field of signed distances."),
        options_(options)
  {}

  /// \param name of an option in the library's table
  CLI::Option* declared(const std::string& name)
  {
    const OptionDeclaration& option = pcl::mrf::optionDeclaration(name);
    const auto set = [this, &option](const std::string& text) { return setByText(options_, option, text); };
    if (option.isNumber())
      return add(option.flag, upperCase(option.unit), helpOf(option), set);
    std::vector<std::string> all;
    for (const auto& entry : option.words)
      all.push_back(entry.first);
    return words(option.flag, all, helpOf(option), set);
  }

  void declared(std::initializer_list<const char*> names)
  {
    for (const char* name : names)
      declared(std::string(name));
  }

  /// A switch of the library's table that is off by default, as a flag that switches it on.
  CLI::Option* declaredFlag(const std::string& name)
  {
    const OptionDeclaration& option = pcl::mrf::optionDeclaration(name);
    return flag(option.flag, option.help, [this, &option] { option.set(options_, 1); });
  }

private:
  Options& options_;
};

/// Parsed words that are not stored in the command itself.
struct Parsed {
  std::vector<std::string> operands;
  Job asked; ///< the options of each job
};

// Each of these functions registers groups of the help, in the order of the stages.

void addInputOptions(OptionParser& parser, Command& command)
{
  parser.group("Normals and sensors");
  parser.declared({"normals.source", "normals.radius"});
  CLI::Option* sensor =
      parser.vectors("--sensor", command.sensors, "position of a sensor, which normals are turned to; repeatable");
  CLI::Option* sensors =
      parser.file("--sensors", "FILE", command.sensorsFile, "sensor positions, x y z per line")->excludes(sensor);
  parser
      .file("--views", "FILE", command.viewsFile,
            "the sensor, from 0, that saw each point: one number per line; without it the nearest")
      ->needs(sensors);
  parser.declared("orientation.sensorOrigin");
  parser.text("--confidence-field", "NAME", command.options.confidenceField,
              "field of the input with the confidence of each point, 0 to 1; default none");
}

void addPreprocessingOptions(OptionParser& parser)
{
  parser.group("Outliers");
  parser.declared({"outliers.alone", "outliers.statistical"});
  parser.declaredFlag("outliers.robust");
  parser.declared("normals.noiseCriteria");

  parser.group("Orientation");
  parser.declared("orientation.maxAngle");
}

void addModelOptions(OptionParser& parser, Options& options)
{
  parser.group("Observation");
  parser.declared("observation.kind");
  CLI::Option* smoothing = parser.declared("observation.smoothing");
  CLI::Option* noise = parser.declared("observation.noise")->excludes(smoothing);
  CLI::Option* model = parser.text("--noise-model", "MODEL", options.observation.noiseModel, noiseModelHelp);
  parser
      .text("--noise-field", "NAME", options.noiseField,
            "field of the input with the standard deviation of each point's noise, a length above 0; default none")
      ->excludes(noise)
      ->excludes(model);
  parser.declared({"observation.gradientWeight", "observation.neighbors", "observation.maxDistance"});

  parser.group("Prior");
  parser.declared({"prior.kind", "prior.beta", "prior.energy"});

  parser.group("Grid");
  CLI::Option* quality = parser.declared("multiscale.quality");
  parser.declared("multiscale.voxelSize")->excludes(quality);
  parser.declared({"unit", "search", "multiscale.padding", "multiscale.maxMemory", "multiscale.denseVoxels"});

  parser.group("Solver");
  parser.declared({"solver.method", "solver.maxIterations", "solver.changeTolerance", "solver.seed"});
}

void addMeshOptions(OptionParser& parser, Options& options)
{
  parser.group("Mesh");
  CLI::Option* remesh = parser.declared("remesher.rounds");
  parser.flag("--no-remesh", "the same as --remesh 0", [&options] { options.remesher.rounds = 0; })->excludes(remesh);
  parser.declared({"remesher.targetEdge", "remesher.triangles", "trimming.kind", "trimming.maxHole", "trimming.maxGap",
                   "trimming.minComponentPoints", "colors"});
  parser.declaredFlag("trimming.watertight");

  parser.group("Error bars");
  parser.declaredFlag("uncertainty.compute");
  parser.declared({"uncertainty.samples", "uncertainty.surfaces", "uncertainty.maxError"});
}

void addOutputOptions(OptionParser& parser, Command& command, Parsed& parsed)
{
  parser.group("Files");
  parser.file("--output-directory", "FOLDER", command.outputDirectory,
              "reconstruct each INPUT to a mesh of its name in this folder, which is made if it is not there");
  parser.words("--input-format", pointFormats,
               "format of INPUT, whatever its name ends in; default: by its name, of "
               "standard input by what it begins with",
               [&command](const std::string& word) { command.inputFormat = word; });
  parser.words("--output-format", meshFormats,
               "format of OUTPUT, whatever its name ends in; default: by its name, in a folder ply",
               [&parsed](const std::string& word) { parsed.asked.outputFormat = word; });
  parser.file(
      "--output-tiles", "FOLDER", parsed.asked.tiles,
      "the mesh also in tiles that join exactly, tile_0000.ply ..., and index.json, which lists them; the folder "
      "is made if it is not there, else has to be empty");
  parser.whole("--tile-triangles", command.tileTriangles, 1, 0x1p31,
               "largest number of triangles in a tile; default 1000000");
  parser.file("--report", "FILE.json", parsed.asked.report,
              "all parameters, counts, times and statistics; with --output-directory it stands for NAME-FILE.json "
              "beside the mesh of input NAME, and so do --output-tiles, --field and --picture");
  parser.file("--field", "FILE.vti", parsed.asked.field,
              "the distance field, and the confidence of observed voxels; of a cloud in pieces far apart also "
              "FILE.2.vti, FILE.3.vti ...");
  parser.file("--picture", "FILE.png", parsed.asked.picture, "a rendering of the mesh; needs an X display (xvfb-run)");
  parser.add("--camera", "SIDE|X,Y,Z", cameraHelp, [&command](const std::string& text) {
    command.camera = text;
    return wrongCamera(text);
  });
  parser.group("Run");
  parser.declared("threads");
  CLI::Option* const work = parser.file(
      "--work-directory", "FOLDER", command.workDirectory,
      "keep there what parts of a large run have come to until it is done, for --resume; started by mpirun, "
      "the run shares these parts with all ranks");
  parser.flag("--resume", command.isResumed, "go on with the run whose results are in --work-directory")->needs(work);
  parser.flag("--progress", command.hasProgress, "tell the progress also where standard error is no terminal");
  CLI::Option* verbose =
      parser.flag("-v,--verbose", "print all there is to know", [&command] { command.verbosity = Verbosity::verbose; });
  parser.flag("-q,--quiet", "print errors and warnings only", [&command] { command.verbosity = Verbosity::quiet; })
      ->excludes(verbose);
}

/// What the short help lists.
void addEverydayOptions(ToolOptions& parser)
{
  parser.texts.everyday = {{"--quality", "draft, normal or fine triangles; default normal"},
                           {"--voxel-size", "side of the voxels instead, in INPUT's unit"},
                           {"--sensor", "where the scanner stood; repeatable"},
                           {"--trim", "none: keep all invented surface; default: fill holes"},
                           {"--max-hole", "largest hole to be filled"},
                           {"--watertight", "close all openings, for printing and for volumes"},
                           {"--triangles", "triangles to end with"},
                           {"--no-remesh", "faster, with less even triangles"},
                           {"--color", "confidence, sigma, input or none; default input"},
                           {"--uncertainty", "sigma at each vertex: how far it may be off"},
                           {"--report", "parameters, counts, times, statistics"},
                           {"--picture", "a rendering; needs an X display (xvfb-run)"},
                           {"--threads", "default: all"},
                           {"--help-all", "all options"}};
  parser.texts.examples = {"scan.ply mesh.ply", "front.pcd left.ply right.xyz mesh.ply",
                           "lidar.pcd mesh.vtk --quality fine --color confidence",
                           "scans/*.ply --output-directory meshes --trim none"};
  const char* const behind = "OUTPUT comes behind INPUT";
  parser.texts.hints = {{"-o", behind},
                        {"--out", behind},
                        {"--output", behind},
                        {"-i", behind},
                        {"--in", behind},
                        {"--input", behind},
                        {"--depth", "how fine voxels are is said by --quality or --voxel-size"},
                        {"--resolution", "how fine voxels are is said by --quality or --voxel-size"}};
}

/// The single job, from the words that belong to no option.
Job singleJob(const Parsed& parsed)
{
  const std::vector<std::string>& words = parsed.operands;
  if (words.empty())
    throw UsageError("INPUT and OUTPUT are missing");
  if (words.size() == 1)
    throw UsageError("OUTPUT is missing; it comes last, or --output-directory makes a mesh of each INPUT");
  Job job = parsed.asked;
  job.inputs.assign(words.begin(), words.end() - 1);
  job.output = words.back();
  std::set<std::filesystem::path> files;
  for (const std::string& input : job.inputs) {
    std::error_code error; // files that cannot be found are reported when they are read
    if (!files.insert(std::filesystem::weakly_canonical(input, error)).second && !error)
      throw UsageError("INPUT '" + input + "' is given twice");
  }
  return job;
}

std::vector<Job> jobsInto(const std::string& folder, const Parsed& parsed)
{
  namespace fs = std::filesystem;
  if (parsed.operands.empty())
    throw UsageError("INPUT is missing");
  const std::string format = parsed.asked.outputFormat.empty() ? "ply" : parsed.asked.outputFormat;
  std::vector<Job> jobs;
  std::map<std::string, std::string> inputs; // by their outputs
  for (const std::string& input : parsed.operands) {
    if (input == "-")
      throw UsageError("standard input has no name for a file in --output-directory");
    const std::string name =
        fs::path(extension(input) == "gz" ? fs::path(input).stem() : fs::path(input)).stem().string();
    Job job;
    job.inputs = {input};
    job.output = (fs::path(folder) / (name + "." + format)).string();
    const auto beside = [&](const std::string& option, const std::string& file) {
      if (fs::path(file).has_parent_path())
        throw UsageError(option + ": '" + file + "' names a folder, but --output-directory does already");
      return file.empty() ? "" : (fs::path(folder) / (name + "-" + file)).string();
    };
    job.report = beside("--report", parsed.asked.report);
    job.field = beside("--field", parsed.asked.field);
    job.picture = beside("--picture", parsed.asked.picture);
    job.tiles = beside("--output-tiles", parsed.asked.tiles);
    const auto [other, isNew] = inputs.try_emplace(job.output, input);
    if (!isNew)
      throw UsageError("'" + other->second + "' and '" + input + "' would both become '" + job.output + "'");
    jobs.push_back(std::move(job));
  }
  return jobs;
}

/// \throw UsageError if the name of an input does not tell its format
void requirePointFormat(const std::string& input)
{
  if (input == "-" || !pointFormatOfName(input).empty())
    return;
  const std::string hint = conversionHint(input);
  throw UsageError(
      "INPUT '" + input + "' " +
      (std::filesystem::is_directory(input)
           ? "is a folder; name its files, and where meshes go: " + input + "/*.ply --output-directory meshes"
           : "does not end in " + pointFileExtensions + (hint.empty() ? "; say --input-format" : hint)));
}

/// \throw UsageError if the formats of the files are not known
void resolveFormats(Command& command, const std::string& outputFormat)
{
  for (Job& job : command.jobs) {
    if (command.inputFormat.empty())
      std::for_each(job.inputs.begin(), job.inputs.end(), requirePointFormat);
    if (job.output == "-" && outputFormat.empty())
      throw UsageError("OUTPUT is standard output, which has no name to tell the format; say --output-format");
    job.outputFormat = outputFormat.empty() ? extension(job.output) : outputFormat;
    if (!isOneOf(job.outputFormat, meshFormats))
      throw UsageError("OUTPUT '" + job.output + "' " +
                       (std::filesystem::is_directory(job.output) || job.output.back() == '/'
                            ? "is a folder; name the mesh in it, or say --output-directory " + job.output
                            : "does not end in " + alternatives(meshFormats) + "; say --output-format"));
  }
}

} // namespace

Command parseCommandLine(int argc, const char* const* argv)
{
  Command command;
  Parsed parsed;
  OptionParser parser(command.options);
  parser.texts.usage = {"[OPTIONS] INPUT... OUTPUT", "[OPTIONS] INPUT... --output-directory FOLDER"};
  parser.operands(parsed.operands, std::string::npos);
  parser.texts.operands = {{"INPUT", "points: " + pointFileExtensions + "; -: standard input"},
                           {"OUTPUT", "mesh: " + alternatives(meshFormats) + "; -: standard output"}};
  addEverydayOptions(parser);
  parser.group("Preset");
  parser.choice<pcl::mrf::Preset>(
      "--preset", pcl::mrf::names<pcl::mrf::Preset>(),
      [&command](pcl::mrf::Preset preset) { command.options = presetOptions(preset); },
      "settings that the other options change; default: as shown here");
  addInputOptions(parser, command);
  addPreprocessingOptions(parser);
  addModelOptions(parser, command.options);
  addMeshOptions(parser, command.options);
  addOutputOptions(parser, command, parsed);
  parser.texts.notes = {"The method is that of Paulsen, Baerentzen and Larsen, Markov Random Field Surface "
                        "Reconstruction, 2010. s is the sampling distance of the points, see --unit. Lengths are in "
                        "the unit of INPUT; auto, or 0, stands for the automatic value of those that have one.",
                        "Several INPUTs before OUTPUT are one cloud. Sensors of their own, normals, colors and "
                        "intensities count if all files have them; options that name a field hold for all files.",
                        "Exit status: 0 done, 1 a file cannot be read or written or holds nothing to reconstruct, 2 "
                        "wrong usage, 3 the method failed; of several inputs that of the first one that failed."};

  parser.parse(argc, argv);
  if (command.outputDirectory.empty())
    command.jobs = {singleJob(parsed)};
  else
    command.jobs = jobsInto(command.outputDirectory, parsed);
  resolveFormats(command, parsed.asked.outputFormat);
  if (!command.camera.empty() && command.jobs.front().picture.empty())
    throw UsageError("--camera: '" + command.camera + "' has no picture to be for; say --picture FILE.png");
  if (parser.isGiven("--tile-triangles") && parsed.asked.tiles.empty())
    throw UsageError("--tile-triangles: there are no tiles for it; say --output-tiles FOLDER");
  requireMeaning(command.options, [&parser](const std::string& name) { return parser.isGiven(name); });
  if (command.options.uncertainty.surfaces > 0 && command.jobs.front().output == "-")
    throw UsageError("--write-samples: standard output holds one mesh; give OUTPUT a name for the others to be like");
  return command;
}

} // namespace mrf_apps
