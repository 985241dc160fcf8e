#include "console.h"

#include "support/option_names.h"
#include "support/report_json.h"

#include <nlohmann/json.hpp>

#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace mrf_apps {
namespace {

using pcl::mrf::Report;

__attribute__((format(printf, 1, 2))) std::string format(const char* pattern, ...)
{
  std::array<char, 512> text;
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text.data(), text.size(), pattern, arguments);
  va_end(arguments);
  return text.data();
}

/// 1,234,567.
std::string grouped(std::int64_t number)
{
  std::string digits = std::to_string(number);
  for (int position = static_cast<int>(digits.size()) - 3; position > (number < 0 ? 1 : 0); position -= 3)
    digits.insert(static_cast<std::size_t>(position), ",");
  return digits;
}

std::string counted(std::int64_t number, const std::string& singular, const std::string& plural)
{
  return grouped(number) + " " + (number == 1 ? singular : plural);
}

std::string bytes(double count)
{
  return count < 1e6 ? format("%.1f kB", count / 1e3) : format("%.1f MB", count / 1e6);
}

std::string join(const std::vector<std::string>& words)
{
  std::string result;
  for (const std::string& word : words)
    result += (result.empty() ? "" : ", ") + word;
  return result;
}

double processorSeconds()
{
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

void printLine(const char* heading, const std::string& text)
{
  std::printf("%-10s%s\n", heading, text.c_str());
}

std::string droppedPoints(const pcl::mrf::PointCounts& points)
{
  const std::vector<std::pair<std::int64_t, const char*>> reasons = {
      {points.notFinite, "not finite"},
      {points.duplicates, "duplicates"},
      {points.zeroNormals, "without a normal"},
      {points.zeroConfidence, "without confidence"},
      {points.outliersAlone, "standing alone"},
      {points.outliersBySpacing, "outliers by spacing"},
      {points.outliersByStatistics, "outliers by statistics"},
      {points.noiseByPlaneFit, "noise by plane fit"},
      {points.outliersByField, "against a robust field"},
      {points.smallComponents, "in small components"},
      {points.alone, "alone"}};
  std::vector<std::string> words;
  for (const auto& [count, reason] : reasons)
    if (count > 0)
      words.push_back(grouped(count) + " " + reason);
  return words.empty() ? "none dropped" : "dropped: " + join(words);
}

std::string normals(const Report& report)
{
  std::string text = report.normalsEstimated ? "normals estimated" : "normals from the input";
  if (report.vote != pcl::mrf::OrientationVote::none) {
    const char* voters = report.sensorOriginUsed                               ? "towards the file's own viewpoint"
                         : report.vote == pcl::mrf::OrientationVote::sensor    ? "towards the sensors"
                         : report.vote == pcl::mrf::OrientationVote::reference ? "by the input's normals"
                                                                               : "outward";
    text += format(", oriented %s", voters);
    text += report.vote == pcl::mrf::OrientationVote::outward
                ? report.orientation.sideIsGuessed ? " or to one side, which is a guess" : ""
                : format(" (agreement %.1f %%)", 100 * report.orientation.agreement);
  }
  return text + ", " + counted(report.orientation.components, "component", "components");
}

std::string resolution(const Report& report)
{
  std::string scores;
  for (const pcl::mrf::ResolutionScore& score : report.resolution.curve)
    scores += format("%s%.3g at %.3g", scores.empty() ? "" : ", ", score.error, score.voxelSize);
  return "voxel by the data: points left out are off by " + scores;
}

std::string topology(const pcl::mrf::MeshStatistics& mesh)
{
  std::string text = counted(mesh.components, "component", "components");
  if (mesh.closed()) {
    text += ", closed";
    if (mesh.manifold())
      text += ", genus " + grouped(mesh.components - mesh.eulerCharacteristic / 2);
  } else
    text += ", " + counted(mesh.boundaryLoops, "boundary", "boundaries");
  if (!mesh.manifold())
    text += ", " + grouped(mesh.nonManifoldEdges + mesh.nonManifoldVertices) + " non-manifold edges and vertices";
  return text;
}

void printDetails(const Report& report)
{
  for (std::size_t i = 0; i < report.levels.size(); ++i) {
    const pcl::mrf::LevelReport& level = report.levels[i];
    printLine(i == 0 ? "levels" : "",
              format("%d x %d x %d voxels of %.4g, %s of them solved for, %s observed up to %.4g; %s %s%d iterations, "
                     "residual %.1e; %.2f + %.2f s",
                     level.size.x, level.size.y, level.size.z, level.voxelSize, grouped(level.unknowns).c_str(),
                     grouped(level.observed).c_str(), static_cast<double>(level.maxDistance),
                     nameOf(level.solve.method).c_str(), level.solve.converged ? "" : "not converged in ",
                     level.solve.iterations, level.solve.relativeResidual, level.observationSeconds,
                     level.solverSeconds));
  }
  printLine("quality", format("mean %.3f, least %.3f; edges %.4g to %.4g, mean %.4g; %.1f %% of the vertices have six",
                              report.mesh.meanQuality, report.mesh.minQuality, report.mesh.minEdge, report.mesh.maxEdge,
                              report.mesh.meanEdge, 100 * report.mesh.regularShare()));
  printLine("remesher", grouped(report.splits) + " splits, " + grouped(report.collapses) + " collapses, " +
                            grouped(report.flips) + " flips, " + grouped(report.refusedOperations) + " refused");
  printLine("", grouped(report.intersectingBeforeRemeshing) + " triangles that intersect others before, " +
                    grouped(report.intersecting) + " after");
  const nlohmann::ordered_json options = toJson(report)["options"];
  bool first = true;
  for (const auto& [stage, values] : options.items()) {
    printLine(first ? "options" : "", stage + " " + values.dump());
    first = false;
  }
}

} // namespace

ProgressDisplay::ProgressDisplay(Verbosity verbosity)
    : verbosity_(verbosity), terminal_(isatty(STDERR_FILENO) != 0), start_(std::chrono::steady_clock::now()),
      last_(start_)
{}

void ProgressDisplay::show(const std::string& stage, double fraction)
{
  if (verbosity_ == Verbosity::quiet)
    return;
  const auto now = std::chrono::steady_clock::now();
  const bool newStage = stage != stage_;
  stage_ = stage;
  if (!terminal_) {
    if (newStage) {
      std::printf("%6.2f s   %s\n", std::chrono::duration<double>(now - start_).count(), stage.c_str());
      std::fflush(stdout);
    }
    return;
  }
  if (!newStage && now - last_ < std::chrono::milliseconds(50))
    return;
  last_ = now;
  constexpr int width = 30;
  const int filled = static_cast<int>(std::lround(width * std::min(std::max(fraction, 0.), 1.)));
  std::fprintf(stderr, "\r\033[K[%s%s] %s", std::string(static_cast<std::size_t>(filled), '#').c_str(),
               std::string(static_cast<std::size_t>(width - filled), ' ').c_str(), stage.c_str());
  std::fflush(stderr);
  drawn_ = true;
}

void ProgressDisplay::clear()
{
  if (drawn_)
    std::fputs("\r\033[K", stderr);
  drawn_ = false;
}

void printSummary(const RunSummary& run, const Report& report, Verbosity verbosity)
{
  for (const std::string& warning : report.warnings)
    std::fprintf(stderr, "warning: %s\n", warning.c_str());
  if (verbosity == Verbosity::quiet)
    return;
  printLine("read", run.input + ": " + counted(static_cast<std::int64_t>(run.points), "point", "points") +
                        (run.fields.empty() ? "" : " with " + join(run.fields)));
  for (const std::string& note : run.notes)
    printLine("", note);
  printLine("used", counted(report.points.used, "point", "points") + "; " + droppedPoints(report.points));
  printLine("", normals(report));
  std::string grid;
  if (!report.levels.empty()) {
    const pcl::mrf::GridSize& size = report.levels.back().size;
    grid = format(" (%d x %d x %d, %zu levels)", size.x, size.y, size.z, report.levels.size());
  }
  printLine("derived",
            format("sampling distance %.4g, voxel %.4g%s, smoothing length %.4g",
                   static_cast<double>(report.density.spacing),
                   static_cast<double>(report.options.multiscale.voxelSize), grid.c_str(), report.smoothingLength));
  if (!report.otherPieces.empty()) {
    std::int64_t points = 0;
    for (const pcl::mrf::PieceReport& piece : report.otherPieces)
      points += piece.points;
    printLine("", counted(static_cast<std::int64_t>(report.otherPieces.size()) + 1, "piece", "pieces") +
                      " far apart; this grid is the largest's, the others have " + counted(points, "point", "points"));
  }
  if (!report.smoothing.curve.empty())
    printLine("", format("noise about %.3g, by %s points left out", report.smoothing.noise,
                         grouped(report.smoothing.heldOut).c_str()));
  if (report.resolution.curve.size() > 1)
    printLine("", resolution(report));
  if (verbosity == Verbosity::verbose)
    printDetails(report);

  std::vector<std::string> times = {format("reading %.2f", run.readingSeconds)};
  for (const pcl::mrf::StageTime& time : report.times)
    times.push_back(format("%s %.2f", time.stage.c_str(), time.seconds));
  times.push_back(format("writing %.2f", run.writingSeconds));
  printLine("seconds", join(times));
  printLine("", format("%.2f in all on %d threads, %.2f of CPU; ",
                       run.readingSeconds + report.seconds + run.writingSeconds, report.threads, processorSeconds()) +
                    "peak memory " + bytes(static_cast<double>(report.peakBytes)));
  printLine("surface", counted(report.mesh.vertices, "vertex", "vertices") + ", " +
                           counted(report.mesh.triangles, "triangle", "triangles") + ", " + topology(report.mesh));
  if (report.trimming.holesFilled + report.trimming.extrapolationsDropped > 0)
    printLine("", counted(report.trimming.holesFilled, "hole or bay", "holes and bays") + " filled" +
                      (report.trimming.holesFilled > 0 ? format(" (largest %.4g)", report.trimming.largestHole) : "") +
                      ", " + counted(report.trimming.extrapolationsDropped, "extrapolation", "extrapolations") +
                      " dropped");
  std::vector<std::string> files;
  for (const auto& [path, size] : run.written)
    files.push_back(path + " (" + bytes(static_cast<double>(size)) + ")");
  printLine("wrote", join(files));
}

} // namespace mrf_apps
