// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/option_table.h>
#include <pcl/surface/mrf/reconstruction.h>

#include "base/memory.h"
#include "base/text.h"
#include "field/prior.h"
#include "levels/multiscale.h"
#include "mesh/polygonizer.h"
#include "mesh/self_intersection.h"
#include "mesh/vertex_fields.h"
#include "options/noise_law.h"
#include "options/stage_timer.h"
#include "options/validation.h"
#include "orientation/oriented_points.h"
#include "pilot/robust.h"
#include "points/gathering.h"
#include "points/preprocessing.h"
#include "points/sampling_density.h"
#include "remesher/remesher.h"
#include "run/option_resolver.h"
#include "run/pieces.h"
#include "run/warnings.h"
#include "tiles/do_task.h"
#include "trimming/trimming.h"
#include "trimming/watertight.h"
#include "uncertainty/plausible_surfaces.h"
#include "uncertainty/uncertainty.h"

#include <algorithm>
#include <memory>
#include <new>
#include <optional>
#include <utility>

namespace pcl::mrf {
namespace {

/// The stages of reconstruct() in order, with roughly expected seconds on two threads of an ordinary processor, for
/// scans with a usual number of holes. Execution corrects the estimates while the run advances.
std::vector<ExpectedStage> expectedStages(std::size_t points, const Options& options)
{
  const double millions = 1e-6 * static_cast<double>(points);
  const bool estimatesNormals = options.normals.source != NormalSource::use;
  // Other solvers carry information one voxel per iteration, and take about 20 times as long as multigrid.
  const double solving = options.solver.method == SolverMethod::multigrid ? 1 : 20;
  return {{"gathering", .1 * millions},
          {"outliers", .6 * millions},
          {"sampling density", .05 * millions},
          {"normals", estimatesNormals ? .5 * millions : 0},
          {"orientation", .5 * millions},
          {"robust field", options.outliers.robust ? .2 + 5 * millions : 0},
          {"noise", mayAskForNoise(options) ? .15 : 0},
          {"smoothing length", choosesSmoothing(options) ? .5 : 0},
          {"resolution", choosesResolution(options) ? .3 : 0},
          {"volume", options.multiscale.padding == 0 ? .05 : 0},
          {"regularization", solving * (.2 + 14 * millions)},
          {"polygonizer", millions},
          {"trimming", 6 * millions},
          {"remesher", 2.2 * options.remesher.rounds * millions},
          {"uncertainty", wantsUncertainty(options) ? .8 + 2 * millions : 0},
          {"attributes", .2 * millions}};
}

/// What a limit of the run's memory leaves beside its points; 0 if there is no limit. \throw ResourceLimit
std::size_t leftBesidePoints(std::size_t maxMemory, std::size_t points)
{
  constexpr double bytesAtFirst = 76, bytesLater = 50; // per point: while they are oriented, and with the levels
  const double limit = static_cast<double>(maxMemory), first = bytesAtFirst * static_cast<double>(points);
  if (maxMemory == 0)
    return 0;
  if (first >= limit)
    throw ResourceLimit(textOf(3, "multiscale.maxMemory = ", limit / (1 << 20), " MiB is too little for ", points,
                               " points, which take ", first / (1 << 20), " MiB before the first level"));
  return maxMemory - static_cast<std::size_t>(bytesLater * static_cast<double>(points));
}

/// Refuses lengths above the cloud's diagonal. A voxel that holds the whole cloud leaves the system without a unique
/// solution; a smoothing length above the diagonal leaves the field without a zero level.
void requireLengthsWithinCloud(const Options& options, double diagonal)
{
  for (const auto& [name, length] : {std::pair("multiscale.voxelSize", options.multiscale.voxelSize),
                                     {"observation.smoothing", options.observation.smoothing}})
    if (length > diagonal)
      throw InvalidOption(textOf(6, name, " = ", length, " is larger than the cloud, whose diagonal is ", diagonal));
}

/// Drops the points that disagree with a robust field.
void rejectByField(OrientedPoints& points, NeighborSearch& search, const Options& options, Report& report,
                   Execution& execution)
{
  if (!options.outliers.robust)
    return;
  const StageTimer timer("robust field", report, execution);
  // At twice the voxel size the robust field's surface has a quarter of the voxels: if it needs more than a quarter of
  // the memory limit, the whole run will exceed the limit.
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
  points = select(std::move(points), keep);
  search.dropPoints(points.positions, keep, execution);
}

Support supportOf(const OrientedPoints& points, const NeighborSearch& search, float reach, float spacing,
                  const Options& options)
{
  return {points, search, reach, options.unit == LengthUnit::density ? spacing : 0}; // the paper has one reach for all
}

/// The part of a coarser level's zero level that trimming may keep. The limits are wider here, gaps up to them are
/// filled whatever their view, and small components stay: only the finest level's mesh decides about those.
TriangleMesh trimmedGenerously(TriangleMesh mesh, const Support& support, float diagonal,
                               const ResolvedOptions& options, Execution& execution)
{
  constexpr float wider = 1.25f;
  TrimmingOptions trimming = options.trimming;
  trimming.maxHole *= wider;
  trimming.maxGap *= wider;
  trimming.minComponentPoints = 0;
  setConfidences(mesh, support, options.observation.confidenceShape, execution);
  if (std::all_of(mesh.confidences.begin(), mesh.confidences.end(), [](float value) { return value > 0; }))
    return mesh;
  return trim(std::move(mesh), support.points(), support.search(), diagonal, trimming, execution).mesh;
}

NoiseReport describe(const NoiseModel& model)
{
  NoiseReport report;
  report.isByRange = model.isByRange;
  report.isCorrelated = model.isCorrelated;
  report.medianKey = model.medianKey;
  report.deviation = model.deviation;
  report.exponent = model.exponent;
  report.lengthening = model.lengthening;
  report.groups.assign(model.groups.begin(), model.groups.end());
  return report;
}

/// Estimates the points' noise, or takes it as known, and resolves the options that follow from it. Options that do not
/// follow from the noise are chosen by held-out points.
void chooseByData(OrientedPoints& points, NeighborSearch& search, OptionResolver& resolver, Report& report,
                  Execution& execution)
{
  const ObservationOptions& requested = report.options.observation;
  const double constant = constantNoise(requested);
  const bool isGivenSmoothing = requested.smoothing > 0, variesAsKnown = !points.deviations.empty();
  if (!mayAskForNoise(report.options) || (isGivenSmoothing && !variesAsKnown))
    return resolver.chooseByData(points, search, report, execution);
  NoiseModel noise;
  {
    const StageTimer timer("noise", report, execution);
    noise = estimateNoise(points, search, constant, execution);
    report.noise = describe(noise);
    report.noise.isKnown = variesAsKnown || constant > 0;
    if (variesAsKnown || noise.weighsPoints())
      setDeviations(points, noise, execution);
    if (noise.isStrong)
      fitNormalsToNoise(points, report.options, search, report, execution);
  }
  if (noise.isCorrelated && !isGivenSmoothing) {
    report.noise.smoothing = noise.smoothing;
    resolver.followNoise(noise);
    return;
  }
  if ((report.noise.isKnown || noise.isStrong) && !isGivenSmoothing)
    resolver.knowNoise(noise.deviation);
  resolver.chooseByData(points, search, report, execution);
}

/// Runs work that does not use the search of the points. If memory is short, the search frees its own meanwhile.
template <typename Work>
void withoutSearch(bool isShort, NeighborSearch& search, const OrientedPoints& points, Execution& execution,
                   const Work& work)
{
  if (!isShort)
    return work();
  search.rest();
  releaseFreedMemory(); // the freed blocks are too small for most allocations of the work and the search
  work();
  releaseFreedMemory();
  search.wake(points.positions, execution);
}

/// Solves all pieces and puts their levels into the report. \param search of all points
DistanceField solveLevels(const CloudPieces& pieces, const OrientedPoints& points, NeighborSearch& search,
                          const ResolvedOptions& options, Report& report, Execution& execution)
{
  const StageTimer timer("regularization", report, execution);
  const float spacing = report.density.spacing, diagonal = pieces.largestDiagonal();
  std::vector<DistanceField> fields;
  for (const SolvedPiece& piece : pieces.all()) {
    const std::unique_ptr<Levels> levels = beginLevels(piece, spacing, options, execution);
    while (!levels->done()) {
      if (options.trimming.kind != Trimming::none && levels->mayLeaveOut()) {
        const float reach = std::max(options.observation.maxDistance, 1.5f * levels->voxelSize());
        const Support support = supportOf(*piece.points, *piece.search, reach, spacing, options);
        levels->refineOnly(trimmedGenerously(levels->zeroLevel(), support, diagonal, options, execution));
      }
      withoutSearch(levels->needsRoom(), search, points, execution, [&] { levels->solveNext(); });
    }
    MultiscaleResult result = levels->result();
    report.predictedBytes = std::max(report.predictedBytes, result.predictedBytes);
    if (fields.empty())
      report.levels = std::move(result.levels);
    else
      report.otherPieces.push_back({static_cast<std::int64_t>(piece.points->size()), std::move(result.levels)});
    fields.push_back(std::move(result.field));
  }
  return DistanceField::ofPieces(std::move(fields));
}

/// Extracts the zero level of the field as a mesh. \throw InvalidInput if the field has none
void cutZeroLevel(Reconstruction& result, const ResolvedOptions& options, Execution& execution)
{
  const StageTimer timer("polygonizer", result.report, execution);
  result.mesh = polygonize(result.field, execution);
  if (result.mesh.triangles.empty())
    throw InvalidInput("the field has no zero level: the normals may all point the same way around" +
                       (options.observation.atPoints()
                            ? ""
                            : ", or prior.beta = " + decimalText(options.prior.beta) + " is too small"));
}

/// \param moved whether the vertices moved since the confidences were set
void setVertexFields(Reconstruction& result, bool moved, const Support& support, const ResolvedOptions& options,
                     Execution& execution)
{
  setNormals(result.mesh, result.field, execution);
  if (moved)
    setConfidences(result.mesh, support, options.observation.confidenceShape, execution);
}

/// Closes the trimmed mesh if it is open. \param statistics of the trimmed mesh, if known; then of the closed mesh
void closeMesh(Reconstruction& result, const Support& support, const ResolvedOptions& options,
               std::optional<MeshStatistics>& statistics, Execution& execution)
{
  if (!statistics)
    statistics = measure(result.mesh, execution);
  if (statistics->closed())
    return;
  const double area = statistics->area;
  result.field = closeOpenings(result.mesh, result.field, execution);
  result.mesh = polygonize(result.field, execution);
  setConfidences(result.mesh, support, options.observation.confidenceShape, execution);
  statistics = measure(result.mesh, execution);
  result.report.trimming.cappedShare = std::max(0., 1 - area / statistics->area);
}

/// Sets the confidences of the vertices, drops surface without support, closes the rest if the options ask for it, and
/// measures the mesh; sets the normals unless the mesh is remeshed.
/// \param diagonal for the automatic limits of holes, cloud's unit \throw InvalidInput if nothing is left
void trimMesh(Reconstruction& result, const Support& support, float diagonal, const ResolvedOptions& options,
              Execution& execution)
{
  Report& report = result.report;
  std::optional<MeshStatistics> statistics;
  {
    const StageTimer timer("trimming", report, execution);
    setConfidences(result.mesh, support, options.observation.confidenceShape, execution);
    TrimResult trimmed = trim(std::move(result.mesh), support.points(), support.search(), diagonal,
                              options.requested().trimming, execution);
    report.trimming = trimmed.summary();
    statistics = trimmed.statistics;
    result.mesh = std::move(trimmed.mesh);
    const bool isCut = options.trimming.kind != Trimming::none && !statistics;
    if (options.trimming.watertight && !result.mesh.triangles.empty())
      closeMesh(result, support, options, statistics, execution);
    const bool isTightened =
        isCut && !options.trimming.watertight && tightenBorders(result.mesh, support, execution) > 0;
    if (!options.remesher.runs())
      setVertexFields(result, isTightened, support, options, execution);
  }
  if (result.mesh.triangles.empty())
    throw InvalidInput(
        "trimming left no surface: nothing of the zero level is supported by data; trim less, or choose a "
        "larger voxel size than " +
        std::to_string(options.multiscale.voxelSize));
  report.mesh = statistics ? *statistics : measure(result.mesh, execution);
  report.meshBeforeRemeshing = report.mesh;
}

/// The remesher's triangles per part, measured as src/method.md says: parts fit the memory limit if the whole mesh does
/// not, or are of the size of tasks; 0: the mesh stays whole.
std::int64_t partsWithin(double limit, const TriangleMesh& mesh, bool areTasks)
{
  constexpr double bytesPerVertex = 420, bytesPerVertexInParts = 120, bytesPerTriangleOfPart = 200;
  constexpr double least = 50000; // smaller parts would consist mostly of their seams
  const auto vertices = static_cast<double>(mesh.vertices.size());
  std::int64_t triangles = 0;
  if (bytesPerVertex * vertices > limit)
    triangles =
        static_cast<std::int64_t>(std::max(least, (limit - bytesPerVertexInParts * vertices) / bytesPerTriangleOfPart));
  const bool isSmall = triangles > 0 && static_cast<double>(triangles) < trianglesPerTask;
  if (areTasks && !isSmall && static_cast<double>(mesh.triangles.size()) > trianglesPerTask)
    triangles = static_cast<std::int64_t>(trianglesPerTask);
  return triangles;
}

/// The weight of a position: 1/σ of its nearest point over that of the median point; empty if σ does not vary.
/// \pre the arguments outlive the result
DistanceWeight weightByNoise(const OrientedPoints& points, const NeighborSearch& search)
{
  const auto [least, most] = std::minmax_element(points.deviations.begin(), points.deviations.end());
  if (!(points.typicalDeviation > 0) || points.deviations.empty() || *least == *most)
    return {};
  return [&](const Eigen::Vector3f& position) {
    Neighbors nearest;
    return search.nearest(position, 1, nearest) < 1
               ? 1.
               : static_cast<double>(points.typicalDeviation) / points.deviations[nearest.indices[0]];
  };
}

/// Remeshes if the options ask for it, and counts triangles that intersect others.
void remeshMesh(Reconstruction& result, const Support& support, NeighborSearch& search, const ResolvedOptions& options,
                Execution& execution)
{
  Report& report = result.report;
  if (options.remesher.runs()) {
    const StageTimer timer("remesher", report, execution);
    const EdgeSizing sizing = edgeSizing(result.mesh, support, execution);
    constexpr double bytesPerUnknown = 8; // of the field
    const double left = memoryLimit(options.multiscale.maxMemory) -
                        bytesPerUnknown * static_cast<double>(report.levels.back().unknowns);
    const std::int64_t partSize = partsWithin(left, result.mesh, execution.tasks() != nullptr);
    result.mesh.confidences = std::vector<float>(); // those of the new vertices are set later
    RemeshResult remeshed;
    withoutSearch(partSize > 0, search, result.points, execution, [&] {
      const DistanceWeight weightAt = partSize > 0 ? DistanceWeight() : weightByNoise(result.points, search);
      remeshed = remesh(std::move(result.mesh), result.field, sizing, options.remesher, execution, partSize, weightAt);
      result.mesh = std::move(remeshed.mesh);
    });
    setVertexFields(result, true, support, options, execution);
    report.remesher = remeshed.summary();
    report.intersectingBeforeRemeshing = remeshed.intersectingBefore;
    report.intersecting = remeshed.intersecting;
    report.options.remesher.targetEdge = static_cast<float>(remeshed.targetEdge);
    report.mesh = measure(result.mesh, execution);
    warnOfTriangles(report);
  } else if (!report.mesh.closed()) {
    report.intersecting = static_cast<std::int64_t>(selfIntersectingTriangles(result.mesh, execution).size());
    report.intersectingBeforeRemeshing = report.intersecting;
  }
}

/// The number of channels of the attributes that the options ask for.
std::size_t channelsOf(const PointAttributes& attributes, const Options& options)
{
  return options.colors == ColorMode::input ? (attributes.colors ? 3 : 0) + (attributes.intensities ? 1 : 0) : 0;
}

/// Adds the cloud's attributes at the vertices, if the options ask for them.
void addAttributes(const PointAttributes& attributes, const NeighborSearch& search, const ResolvedOptions& options,
                   Execution& execution, Reconstruction& result)
{
  const std::size_t ofColor = attributes.colors ? 3 : 0, channels = channelsOf(attributes, options);
  if (channels == 0)
    return;
  const StageTimer timer("attributes", result.report, execution);
  const std::vector<float> values = interpolateAttributes(
      result.mesh.vertices, search,
      [&](std::size_t point, float* read) {
        callHandedIn("the reader of attributes", [&] { attributes.read(result.points.origins[point], read); });
      },
      static_cast<int>(channels), execution);
  for (std::size_t n = 0; n < values.size(); n += channels) {
    if (attributes.colors)
      result.colors.push_back(toRgb(&values[n]));
    if (attributes.intensities)
      result.intensities.push_back(values[n + ofColor]);
  }
}

/// Drops surface whose 95 % half-width exceeds maxError.
void dropBeyondError(Reconstruction& result, float maxError, Execution& execution)
{
  Report& report = result.report;
  UncertaintyReport& uncertainty = report.uncertainty;
  const double best = halfWidthPerSigma *
                      static_cast<double>(*std::min_element(result.mesh.sigmas.begin(), result.mesh.sigmas.end())),
               median = halfWidthPerSigma *
                        (uncertainty.measured.vertices > 0 ? uncertainty.measured.median : uncertainty.fillings.median);
  report.beyondError = limitSigma(result.mesh, maxError / static_cast<float>(halfWidthPerSigma));
  if (report.beyondError.triangles == 0)
    return;
  if (result.mesh.triangles.empty())
    throw InvalidOption(
        textOf(3, "uncertainty.maxError = ", maxError, " leaves no surface: in 95 of 100 cases it is within ", median,
               " (median) of the true one where there are points, at best within ", best, "; allow more"));
  warnOfUncertainSurface(report);
  report.mesh = measure(result.mesh, execution);
  if (report.intersecting > 0)
    report.intersecting = static_cast<std::int64_t>(selfIntersectingTriangles(result.mesh, execution).size());
  describeSigmas(result.mesh, uncertainty);
}

/// Sets sigma at the vertices if the options ask for it, drops surface beyond maxError and draws plausible surfaces.
void addUncertainty(Reconstruction& result, const CloudPieces& pieces, const ResolvedOptions& options,
                    Execution& execution)
{
  if (!wantsUncertainty(options))
    return;
  const StageTimer timer("uncertainty", result.report, execution);
  std::vector<PieceDraws> draws;
  UncertaintyReport& report = result.report.uncertainty;
  report = estimateUncertainty(pieces.all(), result.field, result.report, options, result.mesh, draws, execution);
  if (options.uncertainty.maxError > 0)
    dropBeyondError(result, options.uncertainty.maxError, execution);
  const SampledMesh sampled{result.mesh, result.report.mesh.closed(), options.remesher.fitsTriangles()};
  result.surfaces =
      samplePlausibleSurfaces(draws, report.offset, sampled, options.uncertainty.surfaces, report.shape, execution);
}

/// ℓ, or the length that β implies, cloud's unit; 0 if β is 0.
double smoothingLengthOf(const ResolvedOptions& options)
{
  if (options.observation.atPoints())
    return options.observation.smoothing;
  return options.prior.beta > 0 ? smoothingLength(options.prior, options.multiscale.voxelSize) : 0;
}

/// Makes the field, and the mesh with all its arrays. \param keepsPoints if false, frees data that are not needed later
void makeSurface(const CloudPieces& pieces, const PointAttributes& attributes, bool keepsPoints, NeighborSearch& search,
                 const ResolvedOptions& options, Execution& execution, Reconstruction& result)
{
  Report& report = result.report;
  report.options = options;
  report.smoothingLength = smoothingLengthOf(options);
  result.field = solveLevels(pieces, result.points, search, options, report, execution);
  warnOfUnsolvedLevels(report);
  cutZeroLevel(result, options, execution);
  const Support support =
      supportOf(result.points, search, options.observation.maxDistance, report.density.spacing, options);
  trimMesh(result, support, pieces.largestDiagonal(), options, execution);
  if (!keepsPoints && !wantsUncertainty(options))
    result.points.normals = std::vector<Eigen::Vector3f>(); // {} would keep their memory
  remeshMesh(result, support, search, options, execution);
  addUncertainty(result, pieces, options, execution);
  addAttributes(attributes, search, options, execution, result);
}

} // namespace

void reconstruct(RawCloud cloud, const Options& options, NeighborSearch& search, Execution& execution,
                 Reconstruction& result, bool keepsPoints)
{
  result = Reconstruction();
  Report& report = result.report;
  const RunTimer whole(report);
  report.options = options;
  report.threads = execution.threads();
  validate(options);
  warnOfUnusedOptions(options, report);
  warnOfConfidences(cloud.confidences, report);

  execution.beginRun(expectedStages(cloud.positions.size(), options));
  const PointAttributes attributes = std::move(cloud.attributes);
  PointSet points;
  {
    const StageTimer timer("gathering", report, execution);
    points = gather(std::move(cloud), options, report.points, execution);
  }
  if (!keepsPoints && channelsOf(attributes, options) == 0)
    points.origins = std::vector<std::uint32_t>();
  const double resolution = points.resolution;
  PreparedPoints prepared = preprocess(std::move(points), options, search, report, execution);
  warnOfNoSurface(prepared.points, growthOfNeighbors(prepared.points.positions, search, execution), report);
  result.points = orientPoints(std::move(prepared), options, search, report, execution);
  requireLengthsWithinCloud(options, boundingBox(result.points.positions).diagonal());

  Options affordable = options;
  affordable.multiscale.maxMemory = leftBesidePoints(options.multiscale.maxMemory, result.points.size());
  OptionResolver resolver(affordable, report.density);
  rejectByField(result.points, search, resolver.soFar(), report, execution);
  chooseByData(result.points, search, resolver, report, execution);
  CloudPieces pieces(result.points, search, resolver.soFar(), report, execution);
  report.diagonal = boundingBox(result.points.positions).diagonal();
  warnOfDroppedPoints(report);
  resolver.limitTrimming(pieces.largestDiagonal());
  pieces.growVolumes(resolver.soFar(), report, execution);

  warnOfCoarseInput(resolution, resolver.resolved().multiscale.voxelSize, report);
  makeSurface(pieces, attributes, keepsPoints, search, resolver.resolved(), execution, result);
  report.options.multiscale.maxMemory = options.multiscale.maxMemory;
  if (!keepsPoints) {
    OrientedPoints none;
    none.offset = result.points.offset;
    result.points = std::move(none);
  }
  execution.endRun();
  report.status = Status::ok;
  report.message = "ok";
}

Reconstruction reconstruct(RawCloud cloud, const Options& options, Execution& execution)
{
  const auto search = makeSearch(options.search);
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
  } else
    colors = result.colors;
  return colors;
}

void setFailure(const std::exception_ptr& error, Report& report) noexcept
{
  // A message takes memory, which may be short.
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

} // namespace pcl::mrf
