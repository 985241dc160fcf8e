// SPDX-License-Identifier: BSD-3-Clause
#include "points/preprocessing.h"

#include "base/select_values.h"
#include "options/noise_law.h"
#include "options/stage_timer.h"
#include "points/ghost_points.h"
#include "points/mixed_pixels.h"
#include "points/near_copies.h"
#include "points/normals.h"
#include "points/outliers.h"
#include "points/sampling_density.h"
#include "points/sensor_view.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <sstream>
#include <utility>

namespace pcl::mrf {
namespace {

/// Between these lengths a cloud scaled by a power of two gives the same bytes, scaled. Outside of them squares of
/// areas, the fourth powers of lengths, leave the range of single precision.
constexpr double shortestSpacing = 1e-8, longestDiagonal = 1e9;

/// \throw InvalidInput if the length is outside of that range; the message has a factor that brings it to about 1
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

/// Drops what a sensor that stood still measured again and again.
void removeNearCopies(PointSet& points, NeighborSearch& search, Report& report, Execution& execution)
{
  const int copies = countNearCopies(points.positions, search);
  if (copies == 0)
    return;
  std::vector<std::uint8_t> keep(points.size(), 1);
  const std::int64_t dropped = dropNearCopies(points, search, copies, keep, execution);
  report.points.duplicates += dropped;
  reduce(points, keep, search, execution);
  std::ostringstream text;
  text << "the points were measured " << copies + 1 << " to " << 2 * copies
       << " times, as by a sensor that stands still: of each group the one in the middle was used, and " << dropped
       << " were dropped";
  report.warnings.push_back(text.str());
}

/// Warns of a single sensor that cannot have seen all points, as where registered scans keep the origin of the first.
/// If the origin is the cloud's own and outside of the points' box, it is dropped: one inside at least tells a room.
void checkSensor(PointSet& points, const NeighborDistances& distances, Report& report, Execution& execution)
{
  constexpr double mayBeHidden = .1;
  const bool isOne = points.sensors.size() == 1;
  if (!isOne && (points.sensors.empty() || points.views.empty()))
    return;
  const std::vector<float> spacings = localSpacings(points, distances, execution);
  if (spacings.empty())
    return;
  const double hidden = hiddenShare(points, spacings, execution);
  if (hidden <= mayBeHidden)
    return;
  if (!isOne) {
    report.warnings.push_back(std::to_string(std::lround(100 * hidden)) +
                              " % of the points lie behind others for the sensors that saw them: do the views "
                              "(RawCloud::views) name the sensors in their order, counted from 0?");
    return;
  }
  const BoundingBox box = boundingBox(points.positions);
  const Eigen::Array3f sensor = points.sensors.front();
  const bool isDropped =
      points.hasSensorOrigin && ((sensor < box.lower.array()).any() || (sensor > box.upper.array()).any());
  std::ostringstream text;
  text << std::lround(100 * hidden) << " % of the points lie behind others for the "
       << (isDropped ? "cloud's sensor origin, which was not used" : "only sensor") << ": other sensors saw them; give "
       << "the positions of all (RawCloud::sensors)";
  report.warnings.push_back(text.str());
  if (isDropped) {
    points.sensors.clear();
    points.hasSensorOrigin = false;
  }
}

/// Gives the points to the search, drops outliers, and measures the density of the points that are left. The neighbor
/// distances are not measured again, because the few outliers hardly count among eight neighbors.
void removeOutliers(PointSet& points, const Options& options, NeighborSearch& search, Report& report,
                    Execution& execution)
{
  NeighborDistances distances;
  {
    const StageTimer timer("outliers", report, execution);
    search.setPoints(points.positions, execution);
    if (options.outliers.alone)
      removeNearCopies(points, search, report, execution);
    distances = measureNeighbors(points, search, execution);
    checkSensor(points, distances, report, execution);
    OutlierResult outliers = findOutliers(points, distances, search, options.outliers, execution);
    report.points.outliersAlone = outliers.droppedAlone;
    report.points.outliersByStatistics = outliers.droppedByStatistics;
    if (options.outliers.alone)
      report.points.mixedPixels = dropMixedPixels(points, search, outliers.keep, execution);
    if (reduce(points, outliers.keep, search, execution))
      for (std::vector<float>* values : {&distances.nearest, &distances.eighth, &distances.mean})
        *values = selectValues(*values, outliers.keep);
  }
  requirePoints(points, report);
  const StageTimer timer("sampling density", report, execution);
  report.density = estimateSamplingDensity(points, distances, execution, options.unit);
  requireRange("spacing", report.density.spacing);
  points.spacings = localSpacings(points, distances, execution);
}

/// Drops what other sensors saw through, with the normals.
void removeGhosts(PreparedPoints& prepared, NeighborSearch& search, Report& report, Execution& execution)
{
  const StageTimer timer("outliers", report, execution);
  PointSet& points = prepared.points;
  if (points.spacings.empty())
    return;
  std::vector<std::uint8_t> keep(points.size(), 1);
  report.points.ghosts = dropGhosts(points, prepared.normals, search, keep, execution);
  if (reduce(points, keep, search, execution))
    prepared.normals = selectValues(prepared.normals, keep);
}

/// Warns if all normals of the cloud are zero or not finite, as in a type with normals that were never estimated.
/// \throw InvalidInput if they are to be used as they are
void warnOfZeroNormals(const PointSet& points, const Options& options, Report& report)
{
  if (!points.hadOnlyZeroNormals)
    return;
  if (options.normals.source == NormalSource::use)
    throw InvalidInput("normals.source = use, but the cloud has no normals, as all are zero or not finite; have them "
                       "estimated (auto)");
  report.warnings.push_back("the cloud has no normals, as all are zero or not finite: they were estimated instead");
}

void warnOfFilledNormals(std::size_t count, Report& report)
{
  report.normalsFilled = static_cast<std::int64_t>(count);
  if (count == 0)
    return;
  std::ostringstream text;
  text << count << " of " << report.points.input << " points have no normal, or one that is not finite: theirs were "
       << "estimated, and turned as those around them";
  report.warnings.push_back(text.str());
}

/// The normals to be oriented: the given ones, or estimated ones. Points without a normal get an estimated one; points
/// without a plane, and noise by the paper's criteria, are dropped.
std::vector<Eigen::Vector3f> findNormals(PointSet& points, const Options& options, NeighborSearch& search,
                                         Report& report, Execution& execution)
{
  const StageTimer timer("normals", report, execution);
  const bool given = !points.normals.empty() &&
                     (options.normals.source == NormalSource::automatic || options.normals.source == NormalSource::use);
  report.normalsEstimated = !given;
  if (given) {
    const auto missing = std::count_if(points.normals.begin(), points.normals.end(),
                                       [](const Eigen::Vector3f& normal) { return normal.isZero(); });
    warnOfFilledNormals(static_cast<std::size_t>(missing), report);
    if (missing == 0 && !options.normals.noiseCriteria)
      return std::move(points.normals);
  }

  NormalEstimates estimates = estimateNormals(points, search, report.density.spacing, options.normals, execution,
                                              static_cast<float>(constantNoise(options.observation)));
  std::vector<Eigen::Vector3f> normals = std::move(estimates.normals);
  if (given)
    for (std::size_t i = 0; i < points.size(); ++i)
      if (!points.normals[i].isZero())
        normals[i] = points.normals[i];
  std::vector<std::uint8_t> keep(points.size(), 1);
  report.points.noiseByPlaneFit = dropWhere(
      keep, [&](std::size_t i) { return estimates.isNoise[i] || normals[i].isZero(); }, execution);
  if (reduce(points, keep, search, execution))
    normals = selectValues(normals, keep);
  return normals;
}

} // namespace

bool reduce(PointSet& points, const std::vector<std::uint8_t>& keep, NeighborSearch& search, Execution& execution)
{
  if (std::find(keep.begin(), keep.end(), std::uint8_t{0}) == keep.end())
    return false;
  points = select(std::move(points), keep);
  if (points.size() > 0)
    search.dropPoints(points.positions, keep, execution);
  return true;
}

void requirePoints(const PointSet& points, const Report& report)
{
  if (points.size() >= minPointsOfSurface)
    return;
  const PointCounts& counts = report.points;
  std::ostringstream text;
  text << "at least " << minPointsOfSurface << " points are needed; " << points.size() << " of " << counts.input
       << " are left";
  const std::initializer_list<std::pair<std::int64_t, const char*>> all = {
      {counts.notFinite, "not finite"},
      {counts.duplicates, "duplicates"},
      {counts.zeroNormals, "zero normals"},
      {counts.zeroConfidence, "without confidence"},
      {counts.outliersAlone + counts.outliersByStatistics + counts.mixedPixels + counts.ghosts, "outliers"},
      {counts.noiseByPlaneFit, "without a plane"},
      {counts.smallComponents, "in small components"}};
  const char* separator = "; dropped: ";
  for (const auto& [count, what] : all)
    if (count > 0) {
      text << separator << count << " " << what;
      separator = ", ";
    }
  if (points.size() == 1 && (points.positions.front().cast<double>() + points.offset).isZero(0))
    text << "; all are at 0 0 0, as where PCL's points, which are floats, were filled from a file with doubles";
  throw InvalidInput(text.str());
}

PreparedPoints preprocess(PointSet points, const Options& options, NeighborSearch& search, Report& report,
                          Execution& execution)
{
  requirePoints(points, report);
  warnOfZeroNormals(points, options, report);
  const BoundingBox box = boundingBox(points.positions);
  requireRange("diagonal",
               (box.upper.cast<double>() - box.lower.cast<double>()).norm()); // the square may not fit a float
  removeOutliers(points, options, search, report, execution);
  PreparedPoints prepared;
  prepared.normals = findNormals(points, options, search, report, execution);
  prepared.points = std::move(points);
  if (options.outliers.alone)
    removeGhosts(prepared, search, report, execution);
  requirePoints(prepared.points, report);
  return prepared;
}

} // namespace pcl::mrf
