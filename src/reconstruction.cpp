#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/pieces.h>
#include <pcl/surface/mrf/reconstruction.h>
#include <pcl/surface/mrf/robust.h>
#include <pcl/surface/mrf/self_intersection.h>
#include <pcl/surface/mrf/volume.h>

#include "memory.h"
#include "select_values.h"
#include "spatial_sort.h"

#include <algorithm>
#include <chrono>
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

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start)
{
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Names the running stage and adds it to the report, with its wall-clock time when it goes out of scope.
class StageTimer {
public:
  StageTimer(const char* stage, Report& report, Execution& execution) : times_(report.times), entry_(times_.size())
  {
    execution.beginStage(stage);
    times_.push_back({stage, 0}); // here and not in the destructor, which may not throw
  }
  ~StageTimer() { times_[entry_].seconds = secondsSince(start_); }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

private:
  std::vector<StageTime>& times_;
  std::size_t entry_;
  Clock::time_point start_ = Clock::now();
};

/// Completes the report however the run ends.
class RunTimer {
public:
  explicit RunTimer(Report& report) : report_(report) {}
  ~RunTimer()
  {
    report_.seconds = secondsSince(start_);
    report_.peakBytes = peakMemory();
  }
  RunTimer(const RunTimer&) = delete;
  RunTimer& operator=(const RunTimer&) = delete;

private:
  Report& report_;
  Clock::time_point start_ = Clock::now();
};

std::vector<std::uint8_t> flags(std::size_t count)
{
  return std::vector<std::uint8_t>(count, 1);
}

/// Clears flags by a criterion. \return how many it cleared
template <typename Rejects>
std::int64_t dropWhere(std::vector<std::uint8_t>& keep, const Rejects& rejects, Execution& execution)
{
  constexpr std::int64_t grain = 1 << 14;
  const double dropped =
      execution.sum(static_cast<std::int64_t>(keep.size()), grain, [&](std::int64_t begin, std::int64_t end) {
        std::int64_t count = 0;
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
          if (keep[i] && rejects(i)) {
            keep[i] = 0;
            ++count;
          }
        return static_cast<double>(count);
      });
  return static_cast<std::int64_t>(dropped);
}

bool isUsable(const Eigen::Vector3f& normal)
{
  return normal.allFinite() && normal.cast<double>().norm() > 1e-6;
}

/// \return whether one of the flagged points has a normal
bool hasUsableNormals(const std::vector<Eigen::Vector3f>& normals, const std::vector<std::uint8_t>& keep,
                      Execution& execution)
{
  constexpr std::int64_t grain = 1 << 14;
  return execution.sum(static_cast<std::int64_t>(normals.size()), grain, [&](std::int64_t begin, std::int64_t end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
      if (keep[i] && isUsable(normals[i]))
        return 1.;
    return 0.;
  }) > 0;
}

/// Drops all but the first of equal positions, which follow each other, with their origins. \return how many it dropped
std::int64_t dropRepeated(PointSet& points)
{
  std::size_t kept = 0;
  for (std::size_t n = 0; n < points.positions.size(); ++n)
    if (n == 0 || points.positions[n] != points.positions[kept - 1]) {
      points.positions[kept] = points.positions[n];
      points.origins[kept++] = points.origins[n];
    }
  const std::size_t dropped = points.positions.size() - kept;
  points.positions.resize(kept);
  points.origins.resize(kept);
  return static_cast<std::int64_t>(dropped);
}

/// \throw InvalidInput if the direction to a sensor cannot be computed in single precision
void requireSensor(const Eigen::Vector3d& sensor, std::size_t number)
{
  constexpr double farthest = 1e18;
  if (sensor.cwiseAbs().maxCoeff() <= farthest && sensor.allFinite())
    return;
  std::ostringstream text;
  text << "sensor " << number << " (counted from 0) is not finite, or farther than " << farthest
       << " from the cloud; give a position of the cloud's own frame";
  throw InvalidInput(text.str());
}

/// Keeps the flagged points and hands them to the search; both stay as they are if all are kept.
/// \return whether some were dropped
bool reduce(PointSet& points, const std::vector<std::uint8_t>& keep, NeighbourSearch& search, Execution& execution)
{
  if (std::find(keep.begin(), keep.end(), std::uint8_t{0}) == keep.end())
    return false;
  points = select(points, keep);
  if (points.size() > 0)
    search.dropPoints(points.positions, keep, execution);
  return true;
}

void requirePoints(const PointSet& points, const char* after, const Report& report)
{
  if (points.size() >= fewestPoints)
    return;
  const PointCounts& counts = report.points;
  std::ostringstream text;
  text << points.size() << " of " << counts.input << " points are left after " << after << ", at least " << fewestPoints
       << " are needed (dropped: " << counts.notFinite << " not finite, " << counts.duplicates << " duplicates, "
       << counts.zeroNormals << " zero normals, " << counts.zeroConfidence << " without confidence, "
       << counts.outliersAlone + counts.outliersBySpacing + counts.outliersByStatistics << " outliers, "
       << counts.noiseByPlaneFit << " without a plane, " << counts.smallComponents << " in small components)";
  throw InvalidInput(text.str());
}

/// Between these lengths a cloud scaled by a power of two gives the same bytes, scaled. Outside of them areas and their
/// squares, the fourth powers of lengths, leave the range of single precision.
constexpr double shortestSpacing = 1e-8, longestDiagonal = 1e9;

/// Of the box around the points, also where its square would overflow.
double diagonalOf(const PointSet& points)
{
  const BoundingBox box = boundingBox(points.positions);
  return (box.upper.cast<double>() - box.lower.cast<double>()).norm();
}

/// \throw InvalidInput if a length of the cloud is outside of that range, with a factor that brings it into its middle
void requireRange(const char* what, double length)
{
  if (length >= shortestSpacing && length <= longestDiagonal)
    return;
  std::ostringstream text;
  text.precision(3);
  text << "the points' " << what << " is " << length << ", outside the range of single precision from "
       << shortestSpacing << " to " << longestDiagonal << "; multiply the coordinates by 1e"
       << -std::lround(std::log10(length)) << (length > 1 ? ", or drop points far away" : "");
  throw InvalidInput(text.str());
}

/// Hands the points to the search first, drops outliers, and measures the density of what is left: from the same
/// distances, as the few outliers hardly count among eight neighbours.
void removeOutliers(PointSet& points, const Options& options, NeighbourSearch& search, Report& report,
                    Execution& execution)
{
  NeighbourDistances distances;
  {
    const StageTimer timer("outliers", report, execution);
    search.setPoints(points.positions, execution);
    distances = measureNeighbours(points, search, execution);
    const OutlierResult outliers = findOutliers(points, distances, search, options.outliers, execution);
    report.points.outliersAlone = outliers.droppedAlone;
    report.points.outliersBySpacing = outliers.droppedBySpacing;
    report.points.outliersByStatistics = outliers.droppedByStatistics;
    if (reduce(points, outliers.keep, search, execution))
      for (std::vector<float>* values : {&distances.nearest, &distances.eighth, &distances.mean})
        *values = selectValues(*values, outliers.keep);
  }
  requirePoints(points, "outlier removal", report);
  const StageTimer timer("sampling density", report, execution);
  report.density = estimateSamplingDensity(points, distances, execution, options.unit);
  requireRange("spacing", report.density.spacing);
  points.spacings = localSpacings(points, distances, execution);
}

/// A cloud whose type has room for normals, which nobody has estimated yet.
/// \throw InvalidInput if these are to be used as they are
void warnOfZeroNormals(const PointSet& points, const Options& options, Report& report)
{
  if (!points.hadOnlyZeroNormals)
    return;
  if (options.normals.source == NormalSource::use)
    throw InvalidInput("all normals of the cloud are zero or not finite, and normals.source = use wants them as they "
                       "are; have them estimated (automatic)");
  report.warnings.push_back("all normals of the cloud are zero or not finite: they were estimated instead");
}

/// The normals to be oriented, taken from the points if they are theirs; points without one are dropped.
std::vector<Eigen::Vector3f> findNormals(PointSet& points, const Options& options, NeighbourSearch& search,
                                         Report& report, Execution& execution)
{
  const StageTimer timer("normals", report, execution);
  const bool given = !points.normals.empty() &&
                     (options.normals.source == NormalSource::automatic || options.normals.source == NormalSource::use);
  report.normalsEstimated = !given;
  if (given && !options.normals.noiseCriteria)
    return std::move(points.normals);

  NormalEstimates estimates =
      estimateNormals(points, search, report.density.spacing, options.normals, execution, options.observation.noise);
  std::vector<std::uint8_t> keep = flags(points.size());
  report.points.noiseByPlaneFit = dropWhere(
      keep, [&](std::size_t i) { return estimates.isNoise[i] || (!given && estimates.normals[i].isZero()); },
      execution);
  std::vector<Eigen::Vector3f> normals = given ? points.normals : std::move(estimates.normals);
  if (reduce(points, keep, search, execution))
    normals = given ? points.normals : selectValues(normals, keep);
  return normals;
}

OrientationVote chooseVote(const PointSet& points, const Options& options, const Report& report)
{
  if (!report.normalsEstimated)
    return OrientationVote::none;
  if (options.normals.source == NormalSource::reference && !points.normals.empty())
    return OrientationVote::reference;
  return points.sensors.empty() ? OrientationVote::outward : OrientationVote::sensor;
}

void warnOfGuess(Report& report)
{
  std::ostringstream text;
  text << "the surface is open (" << std::lround(100 * report.orientation.openShare)
       << " % of it encloses no volume), and nothing tells which side is the outside: the side that was taken is a "
          "guess; give the sensor's position (--sensor, setSensorPosition), a cloud that knows its sensor origin, or "
          "normals";
  report.warnings.push_back(text.str());
}

void warnOfDisagreement(const Options& options, Report& report)
{
  // Where the side is a guess, votes on it mean nothing.
  if (report.orientation.sideIsGuessed)
    return warnOfGuess(report);
  if (report.vote == OrientationVote::none || report.orientation.agreement >= options.orientation.lowAgreement)
    return;
  std::ostringstream text;
  text.precision(3);
  text << "only " << 100 * report.orientation.agreement
       << " % of the normals agree with the vote on their orientation ("
       << "lowAgreement = " << options.orientation.lowAgreement
       << "); give sensor positions, or normals that point outward";
  report.warnings.push_back(text.str());
}

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

/// The float spacing of the input's largest coordinates.
double resolutionOf(const PointSet& points)
{
  const BoundingBox box = boundingBox(points.positions);
  const Eigen::Vector3d lower = box.lower.cast<double>() + points.offset,
                        upper = box.upper.cast<double>() + points.offset;
  const auto farthest = static_cast<float>(std::max(lower.cwiseAbs().maxCoeff(), upper.cwiseAbs().maxCoeff()));
  return std::nextafter(farthest, std::numeric_limits<float>::infinity()) - farthest;
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
  options.orientation.neighbourDistance = resolvedNeighbourDistance(options.orientation, density);
  options.normals.radius = resolvedRadius(options.normals, spacing);
  derive(options.normals.maxPlaneDistance, spacing);
  return options;
}

/// Drops the points that a robust field cannot agree with.
void rejectByField(OrientedPoints& points, NeighbourSearch& search, const Options& options, Report& report,
                   Execution& execution)
{
  if (!options.outliers.robust)
    return;
  const StageTimer timer("robust field", report, execution);
  // At twice the voxel size a surface has a quarter of the voxels: what takes more belongs to a run that will not fit.
  const std::size_t limit =
      options.multiscale.maxMemory > 0 ? options.multiscale.maxMemory : availableMemory() / 10 * 8;
  std::vector<std::uint8_t> keep;
  try {
    keep = keptByField(points, search, report.density.spacing, options.multiscale.voxelSize,
                       std::max<std::size_t>(limit / 4, 1), execution);
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

/// Replaces what the data choose by leaving points out, as far as it was left automatic.
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
    holdOut.emplace(points, report.density.spacing, options.multiscale.voxelSize, options.prior.prior, observation,
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
  const NeighbourSearch* search;
  BoundingBox volume; ///< what its field is to cover: the points' box, unless the padding is automatic
};

/// The parts of a cloud in several pieces; empty if it is in one.
struct OwnedPieces {
  std::vector<OrientedPoints> points;
  std::vector<std::unique_ptr<NeighbourSearch>> searches;
};

/// Splits a cloud whose parts cannot see each other, and drops points that are alone.
OwnedPieces split(OrientedPoints& points, NeighbourSearch& search, const Options& options, Report& report,
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
    std::vector<std::uint8_t> keep = flags(points.size());
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
    const Support support(*piece.points, *piece.search, reach, options.unit == LengthUnit::density ? spacing : 0);
    setConfidences(mesh, support, options.observation.confidenceShape, execution);
    if (std::all_of(mesh.confidences.begin(), mesh.confidences.end(), [](float value) { return value > 0; }))
      return mesh;
    return trim(std::move(mesh), *piece.points, *piece.search, diagonal, trimming, execution).mesh;
  };
}

/// The fields of all pieces; the report gets their levels.
/// \param trimming as it was asked for \param diagonal that its limits follow
DistanceField regularise(const std::vector<Piece>& pieces, const Options& options, const TrimmingOptions& trimming,
                         float diagonal, Report& report, Execution& execution)
{
  const StageTimer timer("regularisation", report, execution);
  std::vector<DistanceField> fields;
  for (const Piece& piece : pieces) {
    MultiscaleResult result =
        regularise(*piece.points, *piece.search, report.density.spacing, piece.volume, options.observation,
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

Support supportOf(const Reconstruction& result, const NeighbourSearch& search, const Options& options)
{
  const bool isLocal = options.unit == LengthUnit::density; // the paper has one reach for all points
  return {result.points, search, options.observation.maxDistance, isLocal ? result.report.density.spacing : 0};
}

void setVertexFields(Reconstruction& result, const Support& support, const Options& options, Execution& execution)
{
  setNormals(result.mesh, result.field, execution);
  setConfidences(result.mesh, support, options.observation.confidenceShape, execution);
}

} // namespace

PointSet gather(const std::vector<Eigen::Vector3f>& positions, const std::vector<Eigen::Vector3f>& normals,
                const std::vector<float>& confidences, const std::vector<std::int32_t>& views,
                const std::vector<Eigen::Vector3d>& sensors, bool normalsNeeded, PointCounts& counts)
{
  Execution serial(1);
  return gather(positions, normals, confidences, views, sensors, normalsNeeded, counts, serial);
}

PointSet gather(const std::vector<Eigen::Vector3f>& positions, const std::vector<Eigen::Vector3f>& normals,
                const std::vector<float>& confidences, const std::vector<std::int32_t>& views,
                const std::vector<Eigen::Vector3d>& sensors, bool normalsNeeded, PointCounts& counts,
                Execution& execution)
{
  requireCountable(positions.size());
  counts = PointCounts();
  counts.input = static_cast<std::int64_t>(positions.size());
  std::vector<std::uint8_t> keep = flags(positions.size());
  counts.notFinite = dropWhere(
      keep, [&](std::size_t i) { return !positions[i].allFinite(); }, execution);
  const bool hasNormals = hasUsableNormals(normals, keep, execution);
  if (normalsNeeded && hasNormals)
    counts.zeroNormals = dropWhere(
        keep, [&](std::size_t i) { return !isUsable(normals[i]); }, execution);
  if (!confidences.empty())
    counts.zeroConfidence = dropWhere(
        keep, [&](std::size_t i) { return !std::isfinite(confidences[i]) || !(confidences[i] > 0); }, execution);

  PointSet points;
  points.hadOnlyZeroNormals = !normals.empty() && !hasNormals;
  points.origins = spatialOrder(positions, keep, execution);
  // From here on what is read lies in the order it is read in.
  constexpr std::int64_t grain = 1 << 14;
  const auto forPoints = [&](const auto& body) {
    execution.forRange(static_cast<std::int64_t>(points.origins.size()), grain,
                       [&](std::int64_t begin, std::int64_t end) {
                         for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n)
                           body(n, points.origins[n]);
                       });
  };
  points.positions.resize(points.origins.size());
  forPoints([&](std::size_t n, std::uint32_t origin) { points.positions[n] = positions[origin]; });
  counts.duplicates = dropRepeated(points);
  counts.used = static_cast<std::int64_t>(points.origins.size());

  const BoundingBox box = boundingBox(points.positions);
  points.offset = .5 * (box.lower.cast<double>() + box.upper.cast<double>());
  points.normals.resize(hasNormals ? points.origins.size() : 0);
  points.confidences.resize(confidences.empty() ? 0 : points.origins.size());
  points.views.resize(views.empty() ? 0 : points.origins.size());
  forPoints([&](std::size_t n, std::uint32_t origin) {
    points.positions[n] = (points.positions[n].cast<double>() - points.offset).cast<float>();
    if (hasNormals) {
      const Eigen::Vector3d normal = normals[origin].cast<double>(); // whose square single precision may not hold
      const double length = normal.norm();
      const bool usable = std::isfinite(length) && length > 0;
      points.normals[n] = usable ? Eigen::Vector3f((normal / length).cast<float>()) : Eigen::Vector3f::Zero();
    }
    if (!confidences.empty())
      points.confidences[n] = std::min(confidences[origin], 1.0f);
    if (!views.empty())
      points.views[n] = views[origin];
  });
  for (const Eigen::Vector3d& sensor : sensors) {
    requireSensor(sensor - points.offset, points.sensors.size());
    points.sensors.push_back((sensor - points.offset).cast<float>());
  }
  return points;
}

OrientedPoints preprocess(PointSet points, const Options& options, NeighbourSearch& search, Report& report,
                          Execution& execution)
{
  requirePoints(points, "gathering", report);
  warnOfZeroNormals(points, options, report);
  requireRange("diagonal", diagonalOf(points));
  removeOutliers(points, options, search, report, execution);
  std::vector<Eigen::Vector3f> normals = findNormals(points, options, search, report, execution);
  requirePoints(points, "normal estimation", report);

  report.vote = chooseVote(points, options, report);
  report.sensorOriginUsed = report.vote == OrientationVote::sensor && points.hasSensorOrigin;
  {
    const StageTimer timer("orientation", report, execution);
    report.orientation =
        orientNormals(points, normals, search, report.density, report.vote, options.orientation, execution);
  }
  normals = std::vector<Eigen::Vector3f>(); // {} would keep their memory
  warnOfDisagreement(options, report);
  report.points.smallComponents = report.orientation.pointsDropped;
  points.normals = std::move(report.orientation.normals);
  reduce(points, report.orientation.keep, search, execution);
  report.orientation.normals.clear();
  report.orientation.keep = std::vector<std::uint8_t>();
  requirePoints(points, "dropping small components", report);
  report.points.used = static_cast<std::int64_t>(points.size());

  OrientedPoints oriented;
  oriented.positions = std::move(points.positions);
  oriented.normals = std::move(points.normals);
  oriented.confidences = std::move(points.confidences);
  oriented.spacings = std::move(points.spacings);
  oriented.origins = std::move(points.origins);
  oriented.offset = points.offset;
  return oriented;
}

void reconstruct(PointSet points, const PointCounts& counts, const Options& options, NeighbourSearch& search,
                 Execution& execution, Reconstruction& result)
{
  result = Reconstruction();
  Report& report = result.report;
  const RunTimer whole(report);
  report.options = options;
  report.points = counts;
  report.threads = execution.threads();
  validate(options);

  const double resolution = resolutionOf(points);
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
  result.field = regularise(pieces, resolved, options.trimming, largest, report, execution);
  {
    const StageTimer timer("polygonizer", report, execution);
    result.mesh = polygonize(result.field, resolved.polygonizer, execution);
  }
  if (result.mesh.triangles.empty())
    throw InvalidInput("the field has no zero level: the normals may all point the same way around, or β = " +
                       std::to_string(options.prior.beta) + " is too small");
  const Support support = supportOf(result, search, resolved);
  {
    const StageTimer timer("trimming", report, execution);
    setVertexFields(result, support, resolved, execution);
    report.trimming = trim(std::move(result.mesh), result.points, search, largest, options.trimming, execution);
    result.mesh = std::move(report.trimming.mesh);
    report.trimming.mesh = TriangleMesh();
    const bool isCut = resolved.trimming.trimming != Trimming::none && !report.trimming.statistics;
    if (isCut && tightenBorders(result.mesh, support, execution) > 0 && resolved.remesher.rounds == 0)
      setVertexFields(result, support, resolved, execution);
  }
  if (result.mesh.triangles.empty())
    throw InvalidInput(
        "trimming left no surface: nothing of the zero level is supported by data; trim less, or choose a "
        "larger voxel size than " +
        std::to_string(resolved.multiscale.voxelSize));
  report.mesh = report.trimming.statistics ? *report.trimming.statistics : measure(result.mesh, execution);
  report.meshBeforeRemeshing = report.mesh;
  if (resolved.remesher.rounds > 0) {
    const StageTimer timer("remesher", report, execution);
    RemeshResult remeshed = remesh(result.mesh, result.field, resolved.remesher, execution);
    result.mesh = std::move(remeshed.mesh);
    setVertexFields(result, support, resolved, execution);
    report.splits = remeshed.splits;
    report.collapses = remeshed.collapses;
    report.flips = remeshed.flips;
    report.refusedOperations = remeshed.refusedOperations;
    report.intersectingBeforeRemeshing = remeshed.intersectingBefore;
    report.intersecting = remeshed.intersecting;
    report.options.remesher.targetEdge = static_cast<float>(remeshed.targetEdge);
    report.mesh = measure(result.mesh, execution);
  } else if (!report.mesh.closed()) {
    report.intersecting = static_cast<std::int64_t>(selfIntersectingTriangles(result.mesh, execution).size());
    report.intersectingBeforeRemeshing = report.intersecting;
  }
  report.status = Status::ok;
  report.message = "ok";
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
