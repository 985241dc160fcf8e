// SPDX-License-Identifier: BSD-3-Clause
#include "run/preprocessing.h"

#include "base/select_values.h"
#include "orientation/orientation.h"
#include "points/normals.h"
#include "points/outliers.h"
#include "points/sampling_density.h"
#include "run/pieces.h"
#include "run/stage_timer.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/reconstruction.h>

#include <algorithm>
#include <sstream>
#include <utility>

namespace pcl {
namespace mrf {
namespace {

/// Keeps the flagged points and hands them to the search; both stay as they are if all are kept.
/// \return whether some were dropped
bool reduce(PointSet& points, const std::vector<std::uint8_t>& keep, NeighborSearch& search, Execution& execution)
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
  if (points.size() >= minPointsOfSurface)
    return;
  const PointCounts& counts = report.points;
  std::ostringstream text;
  text << points.size() << " of " << counts.input << " points are left after " << after << ", at least "
       << minPointsOfSurface << " are needed (dropped: " << counts.notFinite << " not finite, " << counts.duplicates
       << " duplicates, " << counts.zeroNormals << " zero normals, " << counts.zeroConfidence << " without confidence, "
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
/// distances, as the few outliers hardly count among eight neighbors.
void removeOutliers(PointSet& points, const Options& options, NeighborSearch& search, Report& report,
                    Execution& execution)
{
  NeighborDistances distances;
  {
    const StageTimer timer("outliers", report, execution);
    search.setPoints(points.positions, execution);
    distances = measureNeighbors(points, search, execution);
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
std::vector<Eigen::Vector3f> findNormals(PointSet& points, const Options& options, NeighborSearch& search,
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
  std::vector<std::uint8_t> keep(points.size(), 1);
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

/// Nobody named a sensor, but normals that look at the origin of the coordinates tell one: most depth cameras and
/// lidars measure from there, and of a surface that encloses something, half of the normals would look away. The origin
/// of a survey's coordinates is too far for that.
bool isSeenFromOrigin(const OrientedPoints& points, Execution& execution)
{
  constexpr std::int64_t oneIn = 1000; // may look past it
  constexpr float maxDiagonals = 100;  // of the cloud, away from it
  const Eigen::Vector3f origin = (-points.offset).cast<float>();
  const BoundingBox box = boundingBox(points.positions);
  if ((origin - (box.lower + box.upper) / 2).norm() > maxDiagonals * box.diagonal())
    return false;
  std::vector<std::uint8_t> looksThere(points.size(), 1);
  const std::int64_t others = dropWhere(
      looksThere, [&](std::size_t i) { return points.normals[i].dot(origin - points.positions[i]) <= 0; }, execution);
  return others * oneIn <= static_cast<std::int64_t>(points.size());
}

} // namespace

OrientedPoints preprocess(PointSet points, const Options& options, NeighborSearch& search, Report& report,
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
  OrientationResult oriented;
  {
    const StageTimer timer("orientation", report, execution);
    oriented = orientNormals(points, normals, search, report.density, report.vote, options.orientation, execution);
    report.orientation = oriented.summary();
  }
  normals = std::vector<Eigen::Vector3f>(); // {} would keep their memory
  warnOfDisagreement(options, report);
  report.points.smallComponents = report.orientation.pointsDropped;
  points.normals = std::move(oriented.normals);
  reduce(points, oriented.keep, search, execution);
  requirePoints(points, "dropping small components", report);
  report.points.used = static_cast<std::int64_t>(points.size());

  OrientedPoints result;
  result.positions = std::move(points.positions);
  result.normals = std::move(points.normals);
  result.confidences = std::move(points.confidences);
  result.spacings = std::move(points.spacings);
  result.origins = std::move(points.origins);
  result.sensors = std::move(points.sensors);
  result.offset = points.offset;
  report.sensorSupposed =
      options.orientation.sensorOrigin && result.sensors.empty() && isSeenFromOrigin(result, execution);
  if (report.sensorSupposed)
    result.sensors.emplace_back((-result.offset).cast<float>());
  return result;
}

} // namespace mrf
} // namespace pcl
