// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.h"
#include "console.h"
#include "mesh_tiles.h"
#include "support/errors.h"
#include "support/float_offset.h"
#include "support/mesh_reader.h"
#include "support/output_files.h"
#include "support/picture.h"
#include "support/point_table.h"
#include "support/report_json.h"
#include "support/sensors.h"
#include "support/surface_mesh.h"
#include "support/text_file.h"
#include "support/tool_main.h"

#include <base/memory.h>
#include <options/stage_timer.h>
#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/option_table.h>
#include <pcl/surface/mrf/reconstruction.h>

#include <nlohmann/json.hpp>

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <utility>

namespace mrf_apps {
namespace {

constexpr const char* toolName = "pcl_mrf_reconstruction";
constexpr const char* memoryAdvice = "choose a larger --voxel-size, or give fewer points";

volatile std::sig_atomic_t interrupted = 0;

/// The first signal cancels the run in an orderly way, the second one ends the process at once.
void interrupt(int signal)
{
  interrupted = 1;
  std::signal(signal, endBySignal);
}

struct Input {
  PointTable table;
  pcl::mrf::RawCloud cloud;             ///< made from the table, which keeps colors and scalars
  std::vector<Eigen::Vector3d> sensors; ///< including the one that the file names, if it is used
};

struct Result {
  SurfaceMesh mesh;
  pcl::mrf::Report report;
  pcl::mrf::DistanceField field; ///< only if it is to be written
  Eigen::Vector3d fieldOffset = Eigen::Vector3d::Zero();
  Eigen::Vector3d shiftOfOutput = Eigen::Vector3d::Zero(); ///< subtracted from the vertices in the mesh's file
  std::vector<std::vector<float>> surfaces; ///< drawn surfaces to write: distances to move each vertex along its normal
};

/// The name of the input in messages.
std::string inputName(const Job& job)
{
  const std::string& first = job.inputs.front();
  const std::size_t others = job.inputs.size() - 1;
  return (first == "-" ? "standard input" : first) +
         (others == 0 ? "" : " and " + std::to_string(others) + (others == 1 ? " other file" : " other files"));
}

/// All files that are read.
std::vector<std::string> filesRead(const Job& job, const Command& command)
{
  std::vector<std::string> files = job.inputs;
  files.insert(files.end(), {command.sensorsFile, command.viewsFile});
  return files;
}

/// \param name of a field that each file must have; empty: none \param option that names the field
void requireField(const std::string& path, const PointTable& table, const std::string& option, const std::string& name)
{
  if (name.empty() || table.scalars.count(name) > 0)
    return;
  std::vector<std::string> names;
  for (const auto& scalar : table.scalars)
    names.push_back(scalar.first);
  throw UsageError(option + ": '" + path + "' has no field '" + name +
                   "'; its scalar fields are: " + (names.empty() ? "none" : joined(names)));
}

/// Reads a file of the input. Drops its sensors if the command names others or turns them off.
PointTable readFile(const std::string& path, const Command& command)
{
  PointTable table = readPoints(path, command.inputFormat);
  requireField(path, table, "--confidence-field", command.options.confidenceField);
  requireField(path, table, "--noise-field", command.options.noiseField);
  const pcl::mrf::NormalSource source = command.options.normals.source;
  if (table.normals.empty() && (source == pcl::mrf::NormalSource::use || source == pcl::mrf::NormalSource::reference))
    throw UsageError("--normals " + nameOf(source) + ": '" + path + "' has no normals; have them estimated (auto)");
  if (!command.sensors.empty() || !command.sensorsFile.empty() || !command.options.orientation.sensorOrigin) {
    table.sensorOrigin.reset();
    table.sensors.clear();
    table.views.clear();
  }
  return table;
}

/// Adds the confidences, noise, sensors and views that the command names.
void addSensors(const Command& command, Input& input)
{
  const auto fieldOf = [&](const std::string& name) {
    return name.empty() ? std::vector<float>() : input.table.scalars.at(name);
  };
  input.cloud.confidences = fieldOf(command.options.confidenceField);
  input.cloud.deviations = fieldOf(command.options.noiseField);
  input.cloud.sensors = command.sensors;
  if (!command.sensorsFile.empty())
    input.cloud.sensors = parseSensors(command.sensorsFile, readWholeFile(command.sensorsFile));
  input.cloud.sensorOrigin = input.table.sensorOrigin;
  if (input.cloud.sensors.empty()) {
    input.cloud.sensors = std::move(input.table.sensors);
    input.cloud.views = std::move(input.table.views);
  }
  if (command.viewsFile.empty())
    return;
  input.cloud.views = parseViews(command.viewsFile, readWholeFile(command.viewsFile));
  try {
    validate(input.cloud);
  } catch (const pcl::mrf::InvalidInput& error) {
    throw FileError(command.viewsFile, error.message());
  }
}

/// Colors and intensities of the input. \param table must outlive the result
pcl::mrf::PointAttributes attributesOf(const PointTable& table)
{
  const std::vector<float>* const intensities = table.hasIntensity() ? &table.scalars.at("intensity") : nullptr;
  return {!table.colors.empty(), intensities != nullptr, [&table, intensities](std::size_t point, float* values) {
            if (!table.colors.empty())
              values = std::copy(table.colors[point].begin(), table.colors[point].end(), values);
            if (intensities != nullptr)
              *values = (*intensities)[point];
          }};
}

/// Reads the input. Positions and normals are moved out of the table, because their memory is needed.
/// \pre the input is not moved afterwards
void readInput(const Job& job, const Command& command, Input& input)
{
  std::vector<PointTable> tables;
  float resolution = 0;
  for (const std::string& path : job.inputs) {
    tables.push_back(readFile(path, command));
    if (tables.back().areFloats)
      resolution = std::max(resolution, floatRounding(tables.back().positions));
  }
  PointTable& table = input.table;
  table = joinPoints(std::move(tables), job.inputs);
  input.cloud.offset = floatOffset(table.positions);
  if (!input.cloud.offset.isZero(0))
    input.cloud.resolution = resolution;
  input.cloud.positions = toFloat(table.positions, input.cloud.offset);
  table.positions = std::vector<Eigen::Vector3d>(); // {} would keep the memory
  input.cloud.normals = std::move(table.normals);
  input.cloud.attributes = attributesOf(table);
  addSensors(command, input);
  input.sensors = sensorsOf(input.cloud, command.options);
}

/// Adds the warnings of the files, first because they may explain the others, and a failure.
void addWarnings(const Input& input, pcl::mrf::Report& report)
{
  report.warnings.insert(report.warnings.begin(), input.table.warnings.begin(), input.table.warnings.end());
}

/// Runs the library without the class for PCL's clouds and meshes, which hold only single precision.
/// \param report is filled in also if it throws
Result reconstruct(Input& input, const Job& job, const Command& command, const pcl::mrf::ProgressCallback& progress,
                   pcl::mrf::Report& report)
{
  pcl::mrf::Execution execution(command.options.threads, progress);
  execution.setTasks(command.results ? command.results : command.ranks);
  pcl::mrf::Options options = command.options;
  if (std::size_t& memory = options.multiscale.maxMemory; command.results != nullptr) {
    // A limit is one of the whole run: what is free, and what the points have taken.
    const std::size_t ofMachine = static_cast<std::size_t>(pcl::mrf::memoryLimit(0)) + pcl::mrf::peakMemory();
    const std::size_t noted = command.results->memory(memory > 0 ? memory : ofMachine);
    memory = memory > 0 ? memory : noted;
  }
  const bool isExact = needDoubles(input.cloud.positions.size(), [&](std::size_t i) {
    return Eigen::Vector3d(input.cloud.positions[i].cast<double>() + input.cloud.offset);
  });
  const auto search = pcl::mrf::makeSearch(options.search);
  pcl::mrf::Reconstruction reconstruction;
  try {
    pcl::mrf::reconstruct(std::move(input.cloud), options, *search, execution, reconstruction, false);
  } catch (...) {
    report = std::move(reconstruction.report);
    addWarnings(input, report);
    throw;
  }
  addWarnings(input, reconstruction.report);

  Result result;
  result.fieldOffset = reconstruction.points.offset;
  result.mesh = toSurfaceMesh(reconstruction, isExact);
  result.report = std::move(reconstruction.report);
  result.surfaces = std::move(reconstruction.surfaces);
  if (!job.field.empty())
    result.field = std::move(reconstruction.field);
  return result;
}

/// The file of a piece's field: FILE.vti, FILE.2.vti, FILE.3.vti …
std::string fieldFile(const std::string& path, std::size_t piece)
{
  const std::size_t dot = path.rfind('.');
  return piece == 0 ? path : path.substr(0, dot) + "." + std::to_string(piece + 1) + path.substr(dot);
}

/// The files of the drawn surfaces: MESH.sample-1.ply, MESH.sample-2.ply …
std::vector<std::string> sampleFiles(const Job& job, const Command& command)
{
  const std::filesystem::path mesh(job.output);
  std::vector<std::string> files;
  for (int n = 1; n <= command.options.uncertainty.surfaces; ++n)
    files.push_back(
        (mesh.parent_path() / (mesh.stem().string() + ".sample-" + std::to_string(n) + mesh.extension().string()))
            .string());
  return files;
}

/// The mesh moved along its normals. Only confidences, colors and intensities are kept; the normals would be wrong.
SurfaceMesh movedMesh(const SurfaceMesh& mesh, const std::vector<float>& distances)
{
  SurfaceMesh moved;
  moved.vertices = mesh.vertices;
  for (std::size_t v = 0; v < moved.vertices.size(); ++v)
    moved.vertices[v] += static_cast<double>(distances[v]) * mesh.normals[v].cast<double>();
  moved.triangles = mesh.triangles;
  moved.confidences = mesh.confidences;
  moved.colors = mesh.colors;
  moved.intensities = mesh.intensities;
  moved.scalars["displacement"] = distances;
  moved.doublePrecision = mesh.doublePrecision;
  return moved;
}

void writeReport(const pcl::mrf::Report& report, const Eigen::Vector3d& shiftOfOutput, const Job& job,
                 const std::string& path)
{
  nlohmann::ordered_json json = {{"schema", reportSchema},
                                 {"tool", "pcl_mrf_reconstruction"},
                                 {"version", MRF_VERSION},
                                 {"input", job.inputs},
                                 {"output", job.output}};
  if (job.inputs.size() == 1)
    json["input"] = job.inputs.front();
  if (!shiftOfOutput.isZero(0))
    json["offset"] = {shiftOfOutput.x(), shiftOfOutput.y(), shiftOfOutput.z()};
  json.update(toJson(report));
  writeJson(path, json);
}

/// Sets status and message by the exception that is being handled.
void describeFailure(pcl::mrf::Report& report)
{
  try {
    throw;
  } catch (const FileError& error) {
    report.status = pcl::mrf::Status::invalidInput;
    report.message = error.what();
  } catch (const UsageError& error) {
    report.status = pcl::mrf::Status::invalidOption;
    report.message = error.what();
  } catch (...) {
    setFailure(std::current_exception(), report);
  }
}

/// Writes the report of a failed run, the only file that is left of it.
void writeFailure(pcl::mrf::Report& report, const Job& job)
{
  try {
    describeFailure(report);
    OutputFiles outputs;
    outputs.add(job.report);
    outputs.write(job.report,
                  [&](const std::string& path) { writeReport(report, Eigen::Vector3d::Zero(), job, path); });
    outputs.publish();
  } catch (...) { // the failure of the run is printed anyway, and matters more
  }
}

RunSummary summarize(const Input& input, const Job& job)
{
  RunSummary summary;
  summary.input = inputName(job);
  summary.points = input.cloud.positions.size();
  if (!input.cloud.normals.empty())
    summary.fields.emplace_back("normals");
  if (!input.table.colors.empty())
    summary.fields.emplace_back("colors");
  for (const auto& scalar : input.table.scalars)
    summary.fields.push_back(scalar.first);
  summary.notes = input.table.notes;
  if (!input.cloud.sensors.empty())
    summary.notes.push_back(std::to_string(input.cloud.sensors.size()) +
                            (input.cloud.sensors.size() == 1 ? " sensor" : " sensors") +
                            (input.cloud.views.empty() ? "" : ", one known for each point"));
  return summary;
}

/// The shares of a job's time for reading and for writing, measured with files in the cache.
constexpr double readingShare = .03, writingShare = .03;

/// Writes the outputs of the job to the declared files. \return paths and bytes
std::vector<std::pair<std::string, std::int64_t>> writeOutputs(const Result& result, const Input& input, const Job& job,
                                                               const Command& command, const TileFolder& tiles,
                                                               OutputFiles& outputs)
{
  std::vector<std::pair<std::string, std::int64_t>> written;
  const auto write = [&](const std::string& path, const std::function<void(const std::string&)>& writer) {
    if (!path.empty())
      written.emplace_back(path == "-" ? "standard output" : path, outputs.write(path, writer));
  };
  write(job.output, [&](const std::string& path) { writeMesh(result.mesh, path, job.outputFormat); });
  if (!job.tiles.empty())
    written.push_back(tiles.write(result.mesh, command.tileTriangles, outputs));
  const std::vector<std::string> samples = sampleFiles(job, command);
  for (std::size_t n = 0; n < samples.size(); ++n)
    write(samples[n], [&](const std::string& path) {
      writeMesh(movedMesh(result.mesh, result.surfaces[n]), path, job.outputFormat);
    });
  write(job.field, [&](const std::string& path) { writeField(result.field, result.fieldOffset, path); });
  if (!job.field.empty())
    for (std::size_t n = 0; n < result.field.otherPieces().size(); ++n) {
      const std::string file = fieldFile(job.field, n + 1);
      refuseInputAsOutput(filesRead(job, command), {file});
      outputs.add(file);
      write(file,
            [&](const std::string& path) { writeField(result.field.otherPieces()[n], result.fieldOffset, path); });
    }
  write(job.picture, [&](const std::string& path) {
    const std::vector<Eigen::Vector3d> origin = {Eigen::Vector3d::Zero()}; // where a sensor is supposed
    const std::vector<Eigen::Vector3d>& sensors = result.report.sensorSupposed ? origin : input.sensors;
    writePicture(result.mesh, sensors, command.camera, path);
  });
  write(job.report, [&](const std::string& path) { writeReport(result.report, result.shiftOfOutput, job, path); });
  return written;
}

/// What to say if a run is resumed with another memory limit than it was begun with, so that its parts are others.
std::string limitAdvice(const Command& command, std::size_t limit)
{
  const std::size_t noted = command.results->memory(limit), mib = std::size_t(1) << 20;
  return noted == limit ? ""
                        : "; its parts were cut for --max-memory " + std::to_string(noted / mib) +
                              ", and this run has " + std::to_string(limit / mib);
}

/// Reads, reconstructs, and publishes the declared outputs. \param report is filled in also if it throws
/// \param progress of the whole job
RunSummary produce(const Job& job, const Command& command, const TileFolder& tiles, OutputFiles& outputs,
                   pcl::mrf::Report& report, const pcl::mrf::ProgressCallback& progress)
{
  const auto start = pcl::mrf::Clock::now();
  progress("reading", 0);
  Input input;
  readInput(job, command, input);
  RunSummary summary = summarize(input, job);
  summary.readingSeconds = pcl::mrf::secondsSince(start);

  Result result = reconstruct(
      input, job, command,
      [&](const std::string& stage, double fraction) {
        return progress(stage, readingShare + (1 - readingShare - writingShare) * fraction);
      },
      report);
  pcl::mrf::releaseFreedMemory(); // memory kept for the next arrays, which the system needs for files
  if (command.isResumed) {
    const int found = command.results->found(), all = found + command.results->made();
    summary.notes.push_back(found == 0 ? "nothing to resume: no part of this run was there"
                                       : std::to_string(found) + " of " + std::to_string(all) +
                                             " parts of the run were there");
    if (found == 0 && all > 0)
      result.report.warnings.push_back(
          "'" + command.workDirectory +
          "' had no result of this run to resume; those of other input or options, if any, "
          "are left there" +
          limitAdvice(command, result.report.options.multiscale.maxMemory));
  }
  result.shiftOfOutput = offsetOfFloats(result.mesh, job.outputFormat);
  if ((job.outputFormat == "stl" || job.outputFormat == "3mf") && !result.report.mesh.closed())
    result.report.warnings.push_back("the surface in " + job.output +
                                     " is open: to print it, or for a volume, close it (trimming.watertight)");
  if (!result.shiftOfOutput.isZero(0))
    result.report.warnings.push_back(shiftWarning(job.output, result.shiftOfOutput));

  const auto writingStart = pcl::mrf::Clock::now();
  progress("writing", 1 - writingShare);
  summary.written = writeOutputs(result, input, job, command, tiles, outputs);
  if (interrupted != 0)
    throw pcl::mrf::Cancelled("interrupted");
  outputs.publish();
  summary.writingSeconds = pcl::mrf::secondsSince(writingStart);
  report = std::move(result.report);
  return summary;
}

/// Runs a job, from its declared outputs to its summary. A cloud that cannot be reconstructed is an error of its file.
/// \param report is filled in also if it throws
RunSummary runJob(const Job& job, const Command& command, pcl::mrf::Report& report,
                  const pcl::mrf::ProgressCallback& progress)
{
  std::vector<std::string> files = sampleFiles(job, command);
  files.insert(files.begin(), {job.output, job.report, job.field, job.picture});
  refuseInputAsOutput(filesRead(job, command), files);
  refuseToReplace(Content::points, job.output);
  const TileFolder tiles(job.tiles, files);
  files.push_back(tiles.firstFile());
  auto outputs = std::make_unique<OutputFiles>();
  for (const std::string& path : files)
    if (!path.empty())
      outputs->add(path);
  report.options = command.options;
  const auto fail = [&] {
    outputs.reset();
    if (interrupted == 0 && !job.report.empty()) // an interrupted run writes no report
      writeFailure(report, job);
  };
  try {
    return produce(job, command, tiles, *outputs, report, progress);
  } catch (const pcl::mrf::InvalidInput& error) {
    fail();
    throw FileError(inputName(job), error.message());
  } catch (...) {
    fail();
    if (interrupted != 0) // while it waited for input
      throw pcl::mrf::Cancelled("interrupted");
    throw;
  }
}

/// Runs the jobs one after the other. A failure is printed to standard error, and the other jobs are still run.
/// \return the exit status of the first one that failed
int runJobs(const Command& command)
{
  const bool isAlone = command.outputDirectory.empty();
  if (!isAlone)
    makeFolder(command.outputDirectory);
  ProgressDisplay display(command, command.jobs.size());
  int firstFailure = exitDone;
  for (std::size_t n = 0; n < command.jobs.size() && (n == 0 || interrupted == 0); ++n) {
    const Job& job = command.jobs[n];
    pcl::mrf::Report report;
    const int status = guarded(toolName, isAlone ? "" : inputName(job), memoryAdvice, [&] {
      try {
        const RunSummary summary = runJob(job, command, report, [&](const std::string& stage, double fraction) {
          display.show(n, stage, fraction);
          return interrupted == 0;
        });
        display.clear();
        if (isAlone || command.verbosity == Verbosity::verbose)
          printSummary(summary, report, command.verbosity, job.output == "-" ? stderr : stdout);
        else
          printLine(summary, report, command.verbosity);
      } catch (const pcl::mrf::Cancelled&) {
        display.clear();
        throw;
      } catch (...) {
        display.clear();
        printWarnings(report, isAlone ? "" : inputName(job));
        throw;
      }
      return exitDone;
    });
    if (firstFailure == exitDone)
      firstFailure = status;
  }
  if (firstFailure != exitDone && command.results != nullptr && command.results->found() + command.results->made() > 0)
    std::fprintf(stderr, "%s: the parts that were done are kept in '%s': go on with --resume\n", toolName,
                 escaped(command.workDirectory).c_str());
  return firstFailure;
}

/// An environment variable that a launcher of parallel processes sets; empty if it is not set.
std::string launched(const char* variable)
{
  const char* const value = std::getenv(variable);
  return value == nullptr ? "" : value;
}

/// True if mpirun started this process.
bool isRank()
{
  return !launched("OMPI_COMM_WORLD_SIZE").empty();
}

/// Warns if a launcher other than Open MPI's started several processes: MPICH's, or Slurm's without Open MPI.
void warnOfLaunchers()
{
  for (const auto& [count, number] : {std::pair("PMI_SIZE", "PMI_RANK"), {"SLURM_STEP_NUM_TASKS", "SLURM_PROCID"}})
    if (const std::string all = launched(count); !isRank() && launched(number) == "0" && !all.empty() && all != "1")
      std::fprintf(stderr,
                   "warning: %s processes were started, each of which does all of this run; Open MPI's mpirun "
                   "has them share it\n",
                   all.c_str());
}

/// The results in the work directory; null if none is asked for. \throw FileError
std::unique_ptr<pcl::mrf::TaskDirectory> keptResults(const Command& command)
{
  if (command.workDirectory.empty())
    return {};
  try {
    return std::make_unique<pcl::mrf::TaskDirectory>(command.workDirectory, command.isResumed, command.ranks);
  } catch (const pcl::mrf::FileError& error) {
    throw FileError(error.what());
  }
}

/// Reads, reconstructs, writes and prints the summary, job by job. A job that fails leaves no output behind.
/// \return the exit status of the first job that failed \throw FileError, UsageError if nothing can be done
int run(Command command, pcl::mrf::TaskRunner* ranks)
{
  command.ranks = ranks;
  const std::unique_ptr<pcl::mrf::TaskDirectory> results = keptResults(command);
  command.results = results.get();
  const Job& first = command.jobs.front();
  if (!first.picture.empty())
    requireDisplay();
  if (first.output == "-" && first.outputFormat != "obj" && isatty(STDOUT_FILENO) != 0)
    throw UsageError("OUTPUT: standard output is a terminal, and " + first.outputFormat + " is no text; name a file");
  // From here on there are temporary files to remove on signals.
  struct sigaction action = {}; // also ends calls that wait for input, as std::signal's do not
  action.sa_handler = isRank() ? endBySignal : interrupt; // mpirun kills its ranks some milliseconds later
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  const int status = runJobs(command);
  if (results && status == exitDone)
    results->remove();
  return status;
}

int runRank(int argc, char** argv)
{
  const bool isSilent = isRank() && launched("OMPI_COMM_WORLD_LOCAL_RANK") != "0"; // another rank prints the same
  Command command;
  try {
    command = parseCommandLine(argc, argv);
  } catch (...) {
    if (!isSilent)
      throw;
    return exitDone;
  }
  warnOfLaunchers();
  std::unique_ptr<pcl::mrf::TaskRunner> ranks;
  if (isRank() && !(ranks = pcl::mrf::tasksOfRanks()))
    return exitDone; // another rank has done the run
  return run(std::move(command), ranks.get());
}

} // namespace
} // namespace mrf_apps

int main(int argc, char** argv)
{
  return mrf_apps::toolMain(mrf_apps::toolName, mrf_apps::memoryAdvice, [&] { return mrf_apps::runRank(argc, argv); });
}
