// SPDX-License-Identifier: BSD-3-Clause
#include "console.h"
#include "support/errors.h"
#include "support/report_json.h"
#include "support/text_file.h"

#include <pcl/surface/mrf/option_table.h>

#include <nlohmann/json.hpp>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <ctime>

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

/// Prints lines under headings.
struct Log {
  std::FILE* file;
  void operator()(const char* heading, const std::string& text) const
  {
    std::fprintf(file, "%-10s%s\n", heading, escaped(text).c_str());
  }
};

/// Counts that are not 0, each with what it counts.
std::string nonZero(const std::vector<std::pair<std::int64_t, std::string>>& counts)
{
  std::vector<std::string> words;
  for (const auto& [count, what] : counts)
    if (count > 0)
      words.push_back(grouped(count) + " " + what);
  return joined(words);
}

std::string droppedPoints(const pcl::mrf::PointCounts& points)
{
  const std::string dropped = nonZero({{points.notFinite, "not finite"},
                                       {points.duplicates, "duplicates"},
                                       {points.zeroNormals, "without a normal"},
                                       {points.zeroConfidence, "without confidence"},
                                       {points.outliersAlone, "standing alone"},
                                       {points.mixedPixels, "between two surfaces"},
                                       {points.ghosts, "seen through by other sensors"},
                                       {points.outliersByStatistics, "outliers by statistics"},
                                       {points.noiseByPlaneFit, "noise by plane fit"},
                                       {points.outliersByField, "against a robust field"},
                                       {points.smallComponents, "in small components"},
                                       {points.alone, "alone"}});
  return dropped.empty() ? "none dropped" : "dropped: " + dropped;
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

/// Describes noise that is known, strong, or shared by neighbors: its source and its consequences.
std::string noise(const pcl::mrf::NoiseReport& noise)
{
  std::string text;
  if (noise.isKnown)
    text = format("noise as given, %.3g for the median point%s", noise.deviation,
                  noise.isCorrelated ? ", and neighbors share it" : "");
  else {
    const pcl::mrf::NoiseByKey &first = noise.groups.front(), &last = noise.groups.back();
    text = format("noise%s, %.3g at %s %.3g, %.3g at %.3g: points weigh by it",
                  noise.isCorrelated || noise.lengthening > 1 ? " that neighbors share" : "", first.deviation,
                  noise.isByRange ? "range" : "spacing", first.key, last.deviation, last.key);
  }
  if (noise.lengthening > 1)
    text += format("; smoothing length %.3g times what points left out ask for", noise.lengthening);
  return noise.smoothing > 0 ? text + format("; smoothing length %.3g and voxels follow it", noise.smoothing) : text;
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

/// \param sigma of the vertices that `what` describes
std::string halfWidths(const char* what, const pcl::mrf::SigmaQuantiles& sigma)
{
  return format("%s +-%.3g (median), +-%.3g (95 %% of the vertices)", what, pcl::mrf::halfWidthPerSigma * sigma.median,
                pcl::mrf::halfWidthPerSigma * sigma.percentile95);
}

std::string interval(const pcl::mrf::SampledQuantity& quantity)
{
  return format("%.6g to %.6g", quantity.lower, quantity.upper);
}

void printShape(const pcl::mrf::SampledShape& shape, const Log& print)
{
  const std::string source = format(", with 95 %% probability, by %d drawn surfaces", shape.surfaces);
  if (shape.isClosed)
    print("volume", interval(shape.volume) + source);
  print("area", interval(shape.area) + (shape.isClosed ? "" : source + "; there is no volume: the mesh is open"));
  print("extent",
        "x " + interval(shape.extent[0]) + ", y " + interval(shape.extent[1]) + ", z " + interval(shape.extent[2]));
}

void printUncertainty(const pcl::mrf::UncertaintyReport& uncertainty, const Log& print)
{
  print("off by", halfWidths("with 95 % probability: amid points", uncertainty.measured));
  if (uncertainty.fillings.vertices > 0)
    print("", halfWidths("in fillings", uncertainty.fillings) + format(", by %s discs left out, the largest %.3g wide",
                                                                       grouped(uncertainty.patches).c_str(),
                                                                       uncertainty.largestPatch));
  if (uncertainty.notCalibrated > 0)
    print("", grouped(uncertainty.notCalibrated) + " vertices are beyond what such discs can tell of");
  print("", format("the scanner's noise is %.3g, by ", uncertainty.noise) +
                counted(uncertainty.heldOut, "point", "points") + " left out");
  if (uncertainty.shape.surfaces > 0)
    printShape(uncertainty.shape, print);
}

void printDetails(const Report& report, const Log& print)
{
  for (std::size_t i = 0; i < report.levels.size(); ++i) {
    const pcl::mrf::LevelReport& level = report.levels[i];
    print(i == 0 ? "levels" : "",
          format("%d x %d x %d voxels of %.4g, %s of them solved for, %s observed up to %.4g; %s %s%d iterations, "
                 "residual %.1e; %.2f + %.2f s",
                 level.size.x, level.size.y, level.size.z, level.voxelSize, grouped(level.unknowns).c_str(),
                 grouped(level.observed).c_str(), static_cast<double>(level.maxDistance),
                 nameOf(level.solve.method).c_str(), level.solve.converged ? "" : "not converged in ",
                 level.solve.iterations, level.solve.relativeResidual, level.observationSeconds, level.solverSeconds));
  }
  print("quality", format("mean %.3f, least %.3f; edges %.4g to %.4g, mean %.4g; %.1f %% of the vertices have six",
                          report.mesh.meanQuality, report.mesh.minQuality, report.mesh.minEdge, report.mesh.maxEdge,
                          report.mesh.meanEdge, 100 * report.mesh.regularShare()));
  const pcl::mrf::RemeshSummary& remesher = report.remesher;
  if (remesher.splits + remesher.collapses + remesher.flips > 0)
    print("remesher", nonZero({{remesher.splits, "splits"},
                               {remesher.collapses, "collapses"},
                               {remesher.flips, "flips"},
                               {remesher.refusedOperations, "refused"}}));
  if (report.intersectingBeforeRemeshing > 0)
    print("", grouped(report.intersectingBeforeRemeshing) + " triangles intersected others before remeshing, " +
                  grouped(report.intersecting) + " do after it");
  const nlohmann::ordered_json options = toJson(report)["options"];
  bool first = true;
  for (const auto& [stage, values] : options.items()) {
    print(first ? "options" : "", stage + " " + values.dump());
    first = false;
  }
}

/// The remaining time, extrapolated from the time so far; empty while that is only a guess.
std::string timeLeft(double seconds, double fraction)
{
  constexpr double soonest = 5, least = .05;
  if (seconds < soonest || fraction < least || fraction >= 1)
    return {};
  const double left = seconds * (1 - fraction) / fraction;
  return left < 60 ? format(", %.0f s left", left) : format(", %.0f min left", std::ceil(left / 60));
}

} // namespace

ProgressDisplay::ProgressDisplay(const Command& command, std::size_t jobs)
    : jobs_(jobs), isTerminal_(isatty(STDERR_FILENO) != 0), start_(std::chrono::steady_clock::now()), last_(start_)
{
  isShown_ = command.hasProgress || (isTerminal_ && command.verbosity != Verbosity::quiet);
}

void ProgressDisplay::show(std::size_t job, const std::string& stage, double fraction)
{
  if (!isShown_)
    return;
  const auto now = std::chrono::steady_clock::now();
  const double whole = (static_cast<double>(job) + std::clamp(fraction, 0., 1.)) / static_cast<double>(jobs_);
  const int percent = static_cast<int>(100 * whole);
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const std::string title = (jobs_ > 1 ? std::to_string(job + 1) + " of " + std::to_string(jobs_) + ", " : "") + stage;
  const bool isNew = title != title_;
  title_ = title;
  if (!isTerminal_) {
    constexpr int step = 5;
    if (!isNew && percent < toldPercent_ + step)
      return;
    toldPercent_ = percent;
    std::fprintf(stderr, "%3d %%  %7.2f s  %s%s\n", percent, seconds, title.c_str(), timeLeft(seconds, whole).c_str());
    return;
  }
  if (!isNew && now - last_ < std::chrono::milliseconds(50))
    return;
  last_ = now;
  constexpr int width = 30;
  const auto filled = static_cast<std::size_t>(width * whole);
  std::fprintf(stderr, "\r\033[K[%s%s] %5.1f %%  %s%s", std::string(filled, '#').c_str(),
               std::string(width - filled, ' ').c_str(), 100 * whole, title.c_str(), timeLeft(seconds, whole).c_str());
  std::fflush(stderr);
  isDrawn_ = true;
}

void ProgressDisplay::clear()
{
  if (isDrawn_)
    std::fputs("\r\033[K", stderr);
  isDrawn_ = false;
}

void printWarnings(const Report& report, const std::string& input)
{
  for (const std::string& warning : report.warnings)
    std::fprintf(
        stderr, "warning: %s\n",
        escaped(input + (input.empty() ? "" : ": ") + pcl::mrf::withOptionNames(warning, pcl::mrf::OptionNaming::flags))
            .c_str());
}

void printSummary(const RunSummary& run, const Report& report, Verbosity verbosity, std::FILE* log)
{
  printWarnings(report);
  if (verbosity == Verbosity::quiet)
    return;
  const Log print{log};
  print("read", run.input + ": " + counted(static_cast<std::int64_t>(run.points), "point", "points") +
                    (run.fields.empty() ? "" : " with " + joined(run.fields)));
  for (const std::string& note : run.notes)
    print("", note);
  print("used", counted(report.points.used, "point", "points") + "; " + droppedPoints(report.points));
  print("", normals(report));
  std::string grid;
  if (!report.levels.empty()) {
    const pcl::mrf::GridSize& size = report.levels.back().size;
    grid = format(" (%d x %d x %d, %zu levels)", size.x, size.y, size.z, report.levels.size());
  }
  print("derived",
        format("sampling distance %.4g, voxel %.4g%s, smoothing length %.4g",
               static_cast<double>(report.density.spacing), static_cast<double>(report.options.multiscale.voxelSize),
               grid.c_str(), report.smoothingLength));
  if (!report.otherPieces.empty()) {
    std::int64_t points = 0;
    for (const pcl::mrf::PieceReport& piece : report.otherPieces)
      points += piece.points;
    print("", counted(static_cast<std::int64_t>(report.otherPieces.size()) + 1, "piece", "pieces") +
                  " far apart; this grid is the largest's, the others have " + counted(points, "point", "points"));
  }
  if (report.noise.deviation > 0)
    print("", noise(report.noise));
  if (!report.smoothing.curve.empty())
    print("", format("noise about %.3g, by %s points left out", report.smoothing.noise,
                     grouped(report.smoothing.heldOut).c_str()));
  if (report.resolution.curve.size() > 1)
    print("", resolution(report));
  if (verbosity == Verbosity::verbose)
    printDetails(report, print);

  std::vector<std::string> times;
  const auto addTime = [&times](const std::string& stage, double seconds) {
    if (seconds >= .005) // smaller ones would print as 0.00
      times.push_back(format("%s %.2f", stage.c_str(), seconds));
  };
  addTime("reading", run.readingSeconds);
  for (const pcl::mrf::StageTime& time : report.times)
    addTime(time.stage, time.seconds);
  addTime("writing", run.writingSeconds);
  const double processorSeconds = static_cast<double>(std::clock()) / CLOCKS_PER_SEC; // of all threads
  print("seconds", format("%.2f in all on ", run.readingSeconds + report.seconds + run.writingSeconds) +
                       counted(report.threads, "thread", "threads") + format(", %.2f of CPU; ", processorSeconds) +
                       "peak memory " + bytes(static_cast<double>(report.peakBytes)));
  if (!times.empty())
    print("", joined(times));
  print("surface", counted(report.mesh.vertices, "vertex", "vertices") + ", " +
                       counted(report.mesh.triangles, "triangle", "triangles") + ", " + topology(report.mesh));
  const std::int64_t holes = report.trimming.holesFilled, extrapolations = report.trimming.extrapolationsDropped;
  if (holes + extrapolations > 0)
    print("", nonZero({{holes, std::string(holes == 1 ? "hole or bay" : "holes and bays") +
                                   format(" filled (largest %.4g)", report.trimming.largestHole)},
                       {extrapolations,
                        std::string(extrapolations == 1 ? "extrapolation" : "extrapolations") + " dropped"}}));
  if (report.options.trimming.watertight)
    print("", format("encloses a volume of %.6g; %.3g %% of the area closes openings", report.mesh.volume,
                     100 * report.trimming.cappedShare));
  if (report.beyondError.triangles > 0)
    print("", counted(report.beyondError.triangles, "triangle", "triangles") +
                  format(" dropped by --max-error, %.3g of an area of %.3g with points",
                         report.beyondError.measuredArea, report.beyondError.area));
  if (report.uncertainty.isComputed)
    printUncertainty(report.uncertainty, print);
  std::vector<std::string> files;
  for (const auto& [path, size] : run.written)
    files.push_back(path + " (" + bytes(static_cast<double>(size)) + ")");
  print("wrote", joined(files));
}

void printLine(const RunSummary& run, const Report& report, Verbosity verbosity)
{
  printWarnings(report, run.input);
  if (verbosity == Verbosity::quiet)
    return;
  std::printf("%s -> %s: %s, %s, %.2f s\n", escaped(run.input).c_str(), escaped(run.written.front().first).c_str(),
              counted(report.points.used, "point", "points").c_str(),
              counted(report.mesh.triangles, "triangle", "triangles").c_str(),
              run.readingSeconds + report.seconds + run.writingSeconds);
  std::fflush(stdout); // the next job may take minutes
}

} // namespace mrf_apps
