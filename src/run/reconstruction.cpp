// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/option_table.h>
#include <pcl/surface/mrf/reconstruction.h>
#include <pcl/surface/mrf/self_intersection.h>

#include "base/memory.h"
#include "pilot/robust.h"
#include "pilot/volume.h"
#include "run/pieces.h"
#include "run/run_plan.h"
#include "run/stage_timer.h"
#include "uncertainty/uncertainty.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <iterator>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <sstream>
#include <utility>

namespace pcl {
namespace mrf {
namespace {

/// Names the rules that dropped more points than an everyday scan has outliers.
void warnOfDroppedPoints(Report& report)
{
  constexpr double share = .02;
  const PointCounts& counts = report.points;
  const std::pair<std::int64_t, const char*> rules[] = {
      {counts.outliersAlone, "stand alone (outliers.alone)"},
      {counts.outliersBySpacing, "are far from their neighbors beside the median (outliers.spacing)"},
      {counts.outliersByStatistics, "are outliers by PCL's statistics (outliers.statistical)"},
      {counts.noiseByPlaneFit, "are noise by the plane fit (normals.noiseCriteria), or have no plane"},
      {counts.smallComponents, "are in small components (orientation.minComponentShare)"},
      {counts.outliersByField, "disagree with a robust field (outliers.robust)"}};
  for (const auto& [count, what] : rules) {
    if (static_cast<double>(count) <= share * static_cast<double>(counts.input))
      continue;
    std::ostringstream text;
    text.precision(2);
    text << 100 * static_cast<double>(count) / static_cast<double>(counts.input)
         << " % of the points were dropped: " << count << " of " << counts.input << ' ' << what
         << "; switch the rule off if they are data";
    report.warnings.push_back(text.str());
  }
}

/// Names the options that were changed although what observes the field has no use for them.
void warnOfUnusedOptions(const Options& options, Report& report)
{
  const ObservationOptions& observation = options.observation;
  const Options unchanged = defaultPreset();
  const auto names = observation.atPoints()
                         ? std::vector<const char*>{"prior.beta", "prior.energy", "observation.neighbors"}
                         : std::vector<const char*>{"observation.smoothing", "observation.gradientWeight"};
  for (const char* name : names) {
    const OptionDeclaration& option = optionDeclaration(name);
    const double value = option.get(options);
    if (value != option.get(unchanged))
      report.warnings.push_back(option.name + " = " + option.textOf(value) + " has no effect on observations at " +
                                (observation.atPoints() ? "points: smoothing and noise tell how far to trust them"
                                                        : "voxels: prior.beta tells how far to trust them"));
  }
}

void warnOfCoarseInput(double resolution, double voxelSize, Report& report)
{
  if (resolution <= .1 * voxelSize)
    return;
  std::ostringstream text;
  text.precision(3);
  text << "the coordinates are resolved to " << resolution << " only, more than a tenth of the voxel size " << voxelSize
       << "; subtract an offset from the cloud before it is stored in single precision";
  report.warnings.push_back(text.str());
}

/// Names the coarsest level that has stopped short of its solution: the finer ones build on it.
void warnOfUnsolvedLevels(Report& report)
{
  const auto unsolved = std::find_if(report.levels.begin(), report.levels.end(), [](const LevelReport& level) {
    return level.observed > 0 && !level.solve.converged;
  });
  if (unsolved == report.levels.end())
    return;
  const SolveReport& solve = unsolved->solve;
  std::ostringstream text;
  text.precision(2);
  text << "the level with voxels of " << unsolved->voxelSize << " has not converged after " << solve.iterations
       << (solve.method == SolverMethod::icm ? " sweeps" : " iterations");
  if (solve.method == SolverMethod::multigrid)
    text << ": its surface would still move by about " << solve.remainingChange << " voxels at the points, "
         << solve.remainingChangeOfFillings << " elsewhere";
  else
    text << ": its relative residual is " << solve.relativeResidual;
  text << "; allow more (solver.maxIterations)";
  report.warnings.push_back(text.str());
}

/// A lattice whose voxels hold the whole cloud observes one place: the system has no unique solution.
void requireVoxelsWithinCloud(float voxelSize, double diagonal)
{
  if (voxelSize <= diagonal)
    return;
  std::ostringstream text;
  text << "multiscale.voxelSize = " << voxelSize << " is larger than the cloud, whose diagonal is " << diagonal;
  throw InvalidOption(text.str());
}

/// Replaces automatic lengths by the values that the stages derive from l̄, so that the report shows them.
Options resolve(const Options& requested, const SamplingDensity& density)
{
  const float spacing = density.spacing;
  Options options = requested;
  const auto derive = [](float& length, float automatic) {
    if (length == 0)
      length = automatic;
  };
  derive(options.multiscale.voxelSize, spacingsPerVoxel(options.multiscale.quality) * spacing);
  derive(options.observation.maxDistance,
         resolvedMaxDistance(options.observation, spacing, options.multiscale.voxelSize));
  options.orientation.neighborDistance = resolvedNeighborDistance(options.orientation, density);
  options.normals.radius = resolvedRadius(options.normals, spacing);
  derive(options.normals.maxPlaneDistance, spacing);
  return options;
}

/// Drops the points that a robust field cannot agree with.
void rejectByField(OrientedPoints& points, NeighborSearch& search, const Options& options, Report& report,
                   Execution& execution)
{
  if (!options.outliers.robust)
    return;
  const StageTimer timer("robust field", report, execution);
  // At twice the voxel size a surface has a quarter of the voxels: what takes more belongs to a run that will not fit.
  const auto limit = static_cast<std::size_t>(memoryLimit(options.multiscale.maxMemory) / 4);
  std::vector<std::uint8_t> keep;
  try {
    keep = keptByField(points, search, report.density.spacing, options.multiscale.voxelSize,
                       std::max<std::size_t>(limit, 1), execution);
  } catch (const ResourceLimit& error) {
    throw ResourceLimit(
        "the robust field (outliers.robust), at twice the voxel size and with a quarter of the memory: " +
        error.message());
  }
  report.points.outliersByField = std::count(keep.begin(), keep.end(), std::uint8_t{0});
  report.points.used -= report.points.outliersByField;
  if (report.points.outliersByField == 0)
    return;
  points = select(points, keep);
  search.dropPoints(points.positions, keep, execution);
}

/// Replaces an automatic smoothing length, and weight of the normals, by what the data choose.
void resolveSmoothing(HoldOut& holdOut, ObservationOptions& observation, Report& report, Execution& execution)
{
  const StageTimer timer("smoothing length", report, execution);
  report.smoothing = holdOut.chooseSmoothing();
  observation.smoothing = static_cast<float>(report.smoothing.smoothing);
  if (observation.gradientWeight == 0)
    observation.gradientWeight = holdOut.chooseGradientWeight(report.smoothing.smoothing, report.smoothing.noise);
}

/// Replaces an automatic voxel size by the coarsest one that the data bear, and the reach that follows from it.
void resolveResolution(HoldOut& holdOut, const ObservationOptions& requested, Options& options, Report& report,
                       Execution& execution)
{
  const StageTimer timer("resolution", report, execution);
  const bool isChosen = report.smoothing.smoothing > 0; // the same number: what was solved with it is known
  report.resolution = holdOut.chooseResolution(isChosen ? report.smoothing.smoothing
                                                        : static_cast<double>(options.observation.smoothing),
                                               options.observation.gradientWeight, report.smoothing.noise);
  options.multiscale.voxelSize = static_cast<float>(report.resolution.voxelSize);
  options.observation.maxDistance =
      resolvedMaxDistance(requested, report.density.spacing, options.multiscale.voxelSize);
}

/// Replaces what hold-out cross-validation chooses, as far as it was left automatic.
void resolveByData(const OrientedPoints& points, const Options& requested, Options& options, Report& report,
                   Execution& execution)
{
  ObservationOptions& observation = options.observation;
  if (!observation.atPoints())
    return;
  const bool choosesSmoothing = observation.smoothing == 0 && !(observation.noise > 0),
             choosesVoxels = !(requested.multiscale.voxelSize > 0) && requested.multiscale.quality == Quality::normal;
  std::optional<HoldOut> holdOut;
  if (choosesSmoothing || choosesVoxels)
    holdOut.emplace(points, report.density.spacing, options.multiscale.voxelSize, options.prior.kind, observation,
                    execution);
  if (choosesSmoothing)
    resolveSmoothing(*holdOut, observation, report, execution);
  observation.smoothing = resolvedSmoothing(observation, report.density.spacing);
  observation.gradientWeight = resolvedGradientWeight(observation);
  report.smoothingLength = observation.smoothing;
  if (choosesVoxels)
    resolveResolution(*holdOut, requested.observation, options, report, execution);
}

/// A part of the points that is solved on its own, and what answers for it.
struct Piece {
  const OrientedPoints* points;
  const NeighborSearch* search;
  BoundingBox volume; ///< what its field is to cover: the points' box, unless the padding is automatic
};

/// The parts of a cloud in several pieces; empty if it is in one.
struct OwnedPieces {
  std::vector<OrientedPoints> points;
  std::vector<std::unique_ptr<NeighborSearch>> searches;
};

/// Splits a cloud whose parts cannot see each other, and drops points that are alone.
OwnedPieces split(OrientedPoints& points, NeighborSearch& search, const Options& options, Report& report,
                  Execution& execution)
{
  // Holes up to the limit are to be filled; boxes grow by the padding, and must not meet.
  const auto voxels = static_cast<float>(8 * (resolvedPadding(options.multiscale) + 2));
  const float minGap = std::max(options.trimming.maxHole, voxels * options.multiscale.voxelSize);
  const Pieces pieces = findPieces(points.positions, minGap);
  OwnedPieces owned;
  if (pieces.points.size() > 1)
    for (const std::vector<std::uint32_t>& piece : pieces.points) {
      owned.points.push_back(select(points, piece));
      owned.searches.push_back(makePointBins());
      owned.searches.back()->setPoints(owned.points.back().positions, execution);
    }
  if (!pieces.alone.empty()) {
    std::vector<std::uint8_t> keep(points.size(), 1);
    for (const std::uint32_t i : pieces.alone)
      keep[i] = 0;
    points = select(points, keep);
    search.dropPoints(points.positions, keep, execution);
    report.points.alone = static_cast<std::int64_t>(pieces.alone.size());
    report.points.used -= report.points.alone;
  }
  return owned;
}

void chooseVolumes(std::vector<Piece>& pieces, const Options& options, Report& report, Execution& execution)
{
  for (Piece& piece : pieces)
    piece.volume = boundingBox(piece.points->positions);
  if (options.multiscale.padding > 0)
    return;
  const StageTimer timer("volume", report, execution);
  const float maxHole =
      options.trimming.trimming == Trimming::none ? std::numeric_limits<float>::infinity() : options.trimming.maxHole;
  for (Piece& piece : pieces)
    piece.volume = chooseVolume(*piece.points, *piece.search, report.density.spacing, options.observation,
                                options.prior, options.solver, options.multiscale, maxHole, execution);
}

Support supportOf(const OrientedPoints& points, const NeighborSearch& search, float reach, float spacing,
                  const Options& options)
{
  return {points, search, reach, options.unit == LengthUnit::density ? spacing : 0}; // the paper has one for all points
}

/// What trimming may keep of a zero level, as a coarser level shows it. Its limits are wider here, and what turns away
/// from the surface around it is not told apart: the finest level's mesh decides that.
SurfaceFilter trimmedGenerously(const Piece& piece, const Options& options, TrimmingOptions trimming, float diagonal,
                                float spacing, Execution& execution)
{
  if (trimming.trimming == Trimming::none)
    return {};
  constexpr float wider = 1.25f;
  trimming.maxHole = wider * resolvedMaxHole(trimming, diagonal);
  trimming.maxGap = wider * resolvedMaxGap(trimming, diagonal);
  trimming.minComponentPoints = 0;
  trimming.minComponentShare = 0;
  return [&piece, &options, trimming, diagonal, spacing, &execution](TriangleMesh mesh, float voxelSize) {
    const float reach = std::max(options.observation.maxDistance, 1.5f * voxelSize);
    setConfidences(mesh, supportOf(*piece.points, *piece.search, reach, spacing, options),
                   options.observation.confidenceShape, execution);
    if (std::all_of(mesh.confidences.begin(), mesh.confidences.end(), [](float value) { return value > 0; }))
      return mesh;
    return trim(std::move(mesh), *piece.points, *piece.search, diagonal, trimming, execution).mesh;
  };
}

/// The fields of all pieces; the report gets their levels.
/// \param trimming as it was asked for \param diagonal that its limits follow
DistanceField regularize(const std::vector<Piece>& pieces, const Options& options, const TrimmingOptions& trimming,
                         float diagonal, Report& report, Execution& execution)
{
  const StageTimer timer("regularization", report, execution);
  std::vector<DistanceField> fields;
  for (const Piece& piece : pieces) {
    MultiscaleResult result =
        regularize(*piece.points, *piece.search, report.density.spacing, piece.volume, options.observation,
                   options.prior, options.solver, options.multiscale, execution,
                   trimmedGenerously(piece, options, trimming, diagonal, report.density.spacing, execution));
    report.predictedBytes = std::max(report.predictedBytes, result.predictedBytes);
    if (fields.empty())
      report.levels = std::move(result.levels);
    else
      report.otherPieces.push_back({static_cast<std::int64_t>(piece.points->size()), std::move(result.levels)});
    fields.push_back(std::move(result.field));
  }
  return DistanceField::ofPieces(std::move(fields));
}

PointSet gather(RawCloud cloud, const Options& options, Report& report, Execution& execution)
{
  const StageTimer timer("gathering", report, execution);
  return gather(std::move(cloud), options, report.points, execution);
}

/// Attributes of the cloud at the vertices, if the options ask for them.
void interpolate(const PointAttributes& attributes, const NeighborSearch& search, Execution& execution,
                 Reconstruction& result)
{
  if (attributes.channels < 1 || result.report.options.colors != ColorMode::input)
    return;
  const StageTimer timer("attributes", result.report, execution);
  result.channels = attributes.channels;
  result.attributes = interpolateAttributes(
      result.mesh.vertices, search,
      [&](std::size_t point, float* values) { attributes.read(result.points.origins[point], values); },
      attributes.channels, execution);
}

/// Sets sigma at the vertices, if it was asked for.
void estimateUncertainty(Reconstruction& result, const std::vector<Piece>& pieces, const Options& options,
                         Execution& execution)
{
  if (!wantsUncertainty(options))
    return;
  const StageTimer timer("uncertainty", result.report, execution);
  std::vector<SolvedPiece> solved;
  for (const Piece& piece : pieces)
    solved.push_back({piece.points, piece.search, piece.volume});
  result.report.uncertainty =
      estimateUncertainty(solved, result.field, result.report.density.spacing, options, result.mesh, execution);
}

void setVertexFields(Reconstruction& result, const Support& support, const Options& options, Execution& execution)
{
  setNormals(result.mesh, result.field, execution);
  setConfidences(result.mesh, support, options.observation.confidenceShape, execution);
}

} // namespace

void reconstruct(RawCloud cloud, const Options& options, NeighborSearch& search, Execution& execution,
                 Reconstruction& result)
{
  result = Reconstruction();
  Report& report = result.report;
  const RunTimer whole(report);
  report.options = options;
  report.threads = execution.threads();
  validate(options);
  warnOfUnusedOptions(options, report);

  execution.beginRun(expectedStages(cloud.positions.size(), options));
  const PointAttributes attributes = std::move(cloud.attributes);
  PointSet points = gather(std::move(cloud), options, report, execution);
  const double resolution = points.resolution;
  result.points = preprocess(std::move(points), options, search, report, execution);
  requireVoxelsWithinCloud(options.multiscale.voxelSize, boundingBox(result.points.positions).diagonal());
  Options resolved = resolve(options, report.density);
  rejectByField(result.points, search, resolved, report, execution);
  resolveByData(result.points, options, resolved, report, execution);
  const OwnedPieces owned = split(result.points, search, resolved, report, execution);
  std::vector<Piece> pieces;
  for (std::size_t n = 0; n < owned.points.size(); ++n)
    pieces.push_back({&owned.points[n], owned.searches[n].get(), {}});
  if (pieces.empty())
    pieces.push_back({&result.points, &search, {}});
  report.diagonal = boundingBox(result.points.positions).diagonal();
  float largest = 0; // what lies far apart has no holes as wide as that
  for (const Piece& piece : pieces)
    largest = std::max(largest, boundingBox(piece.points->positions).diagonal());
  resolved.trimming.maxGap = resolvedMaxGap(resolved.trimming, largest);
  resolved.trimming.maxHole = resolvedMaxHole(resolved.trimming, largest);
  warnOfDroppedPoints(report);
  chooseVolumes(pieces, resolved, report, execution);
  resolved.multiscale.padding = resolvedPadding(resolved.multiscale);
  report.options = resolved;
  if (!resolved.observation.atPoints() && resolved.prior.beta > 0)
    report.smoothingLength = smoothingLength(resolved.prior, resolved.multiscale.voxelSize);
  warnOfCoarseInput(resolution, resolved.multiscale.voxelSize, report);
  result.field = regularize(pieces, resolved, options.trimming, largest, report, execution);
  warnOfUnsolvedLevels(report);
  {
    const StageTimer timer("polygonizer", report, execution);
    result.mesh = polygonize(result.field, resolved.polygonizer, execution);
  }
  if (result.mesh.triangles.empty())
    throw InvalidInput("the field has no zero level: the normals may all point the same way around" +
                       (resolved.observation.atPoints()
                            ? ""
                            : ", or prior.beta = " + decimalText(resolved.prior.beta) + " is too small"));
  const Support support =
      supportOf(result.points, search, resolved.observation.maxDistance, report.density.spacing, resolved);
  std::optional<MeshStatistics> statistics;
  {
    const StageTimer timer("trimming", report, execution);
    setVertexFields(result, support, resolved, execution);
    TrimResult trimmed = trim(std::move(result.mesh), result.points, search, largest, options.trimming, execution);
    report.trimming = trimmed.summary();
    statistics = trimmed.statistics;
    result.mesh = std::move(trimmed.mesh);
    const bool isCut = resolved.trimming.trimming != Trimming::none && !statistics;
    if (isCut && tightenBorders(result.mesh, support, execution) > 0 && resolved.remesher.rounds == 0)
      setVertexFields(result, support, resolved, execution);
  }
  if (result.mesh.triangles.empty())
    throw InvalidInput(
        "trimming left no surface: nothing of the zero level is supported by data; trim less, or choose a "
        "larger voxel size than " +
        std::to_string(resolved.multiscale.voxelSize));
  report.mesh = statistics ? *statistics : measure(result.mesh, execution);
  report.meshBeforeRemeshing = report.mesh;
  if (resolved.remesher.rounds > 0) {
    const StageTimer timer("remesher", report, execution);
    RemeshResult remeshed = remesh(result.mesh, result.field, resolved.remesher, execution);
    result.mesh = std::move(remeshed.mesh);
    setVertexFields(result, support, resolved, execution);
    report.remesher = remeshed.summary();
    report.intersectingBeforeRemeshing = remeshed.intersectingBefore;
    report.intersecting = remeshed.intersecting;
    report.options.remesher.targetEdge = static_cast<float>(remeshed.targetEdge);
    report.mesh = measure(result.mesh, execution);
  } else if (!report.mesh.closed()) {
    report.intersecting = static_cast<std::int64_t>(selfIntersectingTriangles(result.mesh, execution).size());
    report.intersectingBeforeRemeshing = report.intersecting;
  }
  interpolate(attributes, search, execution, result);
  estimateUncertainty(result, pieces, resolved, execution);
  execution.endRun();
  report.status = Status::ok;
  report.message = "ok";
}

Reconstruction reconstruct(RawCloud cloud, const Options& options, Execution& execution)
{
  const auto search = makePointBins();
  Reconstruction result;
  reconstruct(std::move(cloud), options, *search, execution, result);
  return result;
}

std::vector<Rgb> vertexColors(const Reconstruction& result)
{
  std::vector<Rgb> colors;
  if (result.report.options.colors == ColorMode::confidence)
    for (const float confidence : result.mesh.confidences)
      colors.push_back(confidenceColor(confidence));
  else if (result.report.options.colors == ColorMode::sigma) {
    const std::vector<float>& sigmas = result.mesh.sigmas;
    const float largest = sigmas.empty() ? 1 : largestSigmaShown(sigmas);
    for (const float sigma : sigmas)
      colors.push_back(sigmaColor(sigma, largest));
  } else if (result.channels == 3)
    for (std::size_t n = 0; n < result.attributes.size(); n += 3)
      colors.push_back(toRgb(&result.attributes[n]));
  return colors;
}

void setFailure(const std::exception_ptr& error, Report& report) noexcept
{
  // Telling what happened takes memory, of which there may be none left.
  try {
    try {
      std::rethrow_exception(error);
    } catch (const Error& caught) {
      report.status = caught.status();
      report.message = caught.message();
    } catch (const std::bad_alloc&) {
      report.status = Status::resourceLimit;
      report.message = "out of memory; choose a larger voxel size";
    } catch (const std::exception& caught) {
      report.status = Status::internalError;
      report.message = std::string("unexpected error: ") + caught.what();
    } catch (...) {
      report.status = Status::internalError;
      report.message = "unexpected error of an unknown type";
    }
  } catch (...) {
    report.message = "out of memory"; // short enough for a string without memory of its own
  }
}

} // namespace mrf
} // namespace pcl
