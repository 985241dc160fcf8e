#include "run.h"

#include "console.h"
#include "support/errors.h"
#include "support/field_file.h"
#include "support/option_names.h"
#include "support/output_files.h"
#include "support/picture.h"
#include "support/point_table.h"
#include "support/report_json.h"
#include "support/sensors.h"
#include "support/surface_mesh.h"
#include "support/text_file.h"

#include <pcl/surface/mrf_reconstruction.h>

#include <nlohmann/json.hpp>

#include <chrono>
#include <csignal>

namespace mrf_apps {
namespace {

using pcl::mrf::NormalSource;

volatile std::sig_atomic_t interrupted = 0;

/// The first signal ends the run in an orderly way, the second one at once.
void interrupt(int signal)
{
  interrupted = 1;
  std::signal(signal, SIG_DFL);
}

double secondsSince(std::chrono::steady_clock::time_point start)
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Input {
  PointTable table;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero(); ///< subtracted from the table's positions
  std::vector<float> confidences;                   ///< empty: none
  std::vector<Eigen::Vector3d> sensors;             ///< in the table's frame
  std::vector<std::int32_t> views;
};

struct Result {
  SurfaceMesh mesh;
  pcl::mrf::Report report;
  pcl::mrf::DistanceField field; ///< only if it is to be written
  Eigen::Vector3d fieldOffset = Eigen::Vector3d::Zero();
};

std::string scalarNames(const PointTable& table)
{
  std::string result;
  for (const auto& scalar : table.scalars)
    result += (result.empty() ? "" : ", ") + scalar.first;
  return result.empty() ? "none" : result;
}

Input readInput(const Command& command)
{
  Input input;
  input.table = readPoints(command.input);
  input.offset = floatOffset(input.table.positions);
  const NormalSource source = command.options.normals.source;
  if (input.table.normals.empty() && (source == NormalSource::use || source == NormalSource::reference))
    throw UsageError("--normals " + nameOf(source) + ": '" + command.input + "' has no normals");
  const std::string& field = command.options.confidenceField;
  if (!field.empty()) {
    const auto found = input.table.scalars.find(field);
    if (found == input.table.scalars.end())
      throw UsageError("--confidence-field: '" + command.input + "' has no field '" + field +
                       "'; its scalar fields are: " + scalarNames(input.table));
    input.confidences = found->second;
  }
  input.sensors = command.sensorsFile.empty() ? command.sensors : readSensors(command.sensorsFile);
  if (!command.viewsFile.empty()) {
    input.views = readViews(command.viewsFile);
    if (input.views.size() != input.table.size())
      throw FileError(command.viewsFile, "holds " + std::to_string(input.views.size()) + " views for " +
                                             std::to_string(input.table.size()) + " points");
    for (const std::int32_t view : input.views)
      if (static_cast<std::size_t>(view) >= input.sensors.size())
        throw FileError(command.viewsFile, "names sensor " + std::to_string(view) + ", counted from 0; there are " +
                                               std::to_string(input.sensors.size()));
  }
  return input;
}

template <typename PointNT>
Result reconstructAs(Input& input, const Command& command, ProgressDisplay& progress)
{
  pcl::mrf::Options options = command.options;
  if (!input.confidences.empty())
    options.confidenceField = "curvature";
  if (input.table.normals.empty())
    options.normals.source = NormalSource::estimate;
  std::vector<Eigen::Vector3d> sensors = input.sensors;
  for (Eigen::Vector3d& sensor : sensors)
    sensor -= input.offset;

  pcl::MRFReconstruction<PointNT> mrf;
  mrf.setInputCloud(toCloud<PointNT>(input.table, input.offset, input.confidences));
  input.table = PointTable(); // of millions of points: the memory is needed
  mrf.setSensorPositions(sensors, input.views);
  mrf.setOptions(options);
  mrf.setThrowing(true);
  mrf.setProgressCallback([&](const std::string& stage, double fraction) {
    progress.show(stage, fraction);
    return interrupted == 0;
  });
  pcl::PolygonMesh mesh;
  mrf.reconstruct(mesh);

  Result result;
  result.mesh = toSurfaceMesh(mesh, input.offset);
  result.report = mrf.getReport();
  result.report.options.confidenceField = command.options.confidenceField;
  if (!command.field.empty())
    result.field = mrf.getDistanceField();
  result.fieldOffset = mrf.getOffset() + input.offset;
  return result;
}

/// Picks the point type that holds what the input has. Colours win over intensities; a confidence needs a type with a
/// spare float, which those with normals have.
/// The input's table is taken.
Result reconstruct(Input& input, const Command& command, ProgressDisplay& progress)
{
  const bool withNormals = !input.table.normals.empty() || !input.confidences.empty();
  if (!input.table.colours.empty())
    return withNormals ? reconstructAs<pcl::PointXYZRGBNormal>(input, command, progress)
                       : reconstructAs<pcl::PointXYZRGB>(input, command, progress);
  if (input.table.hasIntensity())
    return withNormals ? reconstructAs<pcl::PointXYZINormal>(input, command, progress)
                       : reconstructAs<pcl::PointXYZI>(input, command, progress);
  return withNormals ? reconstructAs<pcl::PointNormal>(input, command, progress)
                     : reconstructAs<pcl::PointXYZ>(input, command, progress);
}

void writeReport(const Result& result, const Command& command, const std::string& path)
{
  nlohmann::ordered_json json = {{"input", command.input}, {"output", command.output}};
  json.update(toJson(result.report));
  writeText(path, json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

RunSummary summarise(const Input& input, const Command& command)
{
  RunSummary summary;
  summary.input = command.input;
  summary.points = input.table.size();
  if (!input.table.normals.empty())
    summary.fields.emplace_back("normals");
  if (!input.table.colours.empty())
    summary.fields.emplace_back("colours");
  for (const auto& scalar : input.table.scalars)
    summary.fields.push_back(scalar.first);
  summary.notes = input.table.notes;
  if (!input.sensors.empty())
    summary.notes.push_back(std::to_string(input.sensors.size()) + " sensors" +
                            (input.views.empty() ? "" : ", one known for each point"));
  return summary;
}

} // namespace

void run(const Command& command)
{
  refuseInputAsOutput({command.input, command.sensorsFile, command.viewsFile},
                      {command.output, command.report, command.field, command.picture});
  if (!command.picture.empty())
    requireDisplay();
  // From here on there are temporary files to remove.
  std::signal(SIGINT, interrupt);
  std::signal(SIGTERM, interrupt);
  OutputFiles outputs;
  for (const std::string& path : {command.output, command.report, command.field, command.picture})
    if (!path.empty())
      outputs.add(path);

  const auto start = std::chrono::steady_clock::now();
  ProgressDisplay progress(command.verbosity);
  progress.show("reading", 0);
  Input input = readInput(command);
  RunSummary summary = summarise(input, command);
  summary.readingSeconds = secondsSince(start);

  const Result result = reconstruct(input, command, progress);

  const auto writingStart = std::chrono::steady_clock::now();
  progress.show("writing", 0);
  const auto write = [&](const std::string& path, const std::function<void(const std::string&)>& writer) {
    if (!path.empty())
      summary.written.emplace_back(path, outputs.write(path, writer));
  };
  write(command.output, [&](const std::string& path) { writeMesh(result.mesh, path, extension(command.output)); });
  write(command.field, [&](const std::string& path) { writeField(result.field, result.fieldOffset, path); });
  write(command.picture, [&](const std::string& path) { writePicture(result.mesh, PictureOptions(), path); });
  write(command.report, [&](const std::string& path) { writeReport(result, command, path); });
  if (interrupted != 0)
    throw pcl::mrf::Cancelled("interrupted");
  outputs.publish();
  summary.writingSeconds = secondsSince(writingStart);
  progress.clear();
  printSummary(summary, result.report, command.verbosity);
}

} // namespace mrf_apps
