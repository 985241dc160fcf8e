// SPDX-License-Identifier: BSD-3-Clause
#include "orientation/oriented_points.h"

#include "base/select_values.h"
#include "options/noise_law.h"
#include "options/stage_timer.h"
#include "orientation/given_signs.h"
#include "orientation/orientation.h"
#include "points/mixed_pixels.h"
#include "points/noise.h"
#include "points/normals.h"

#include <pcl/surface/mrf/exceptions.h>

#include <cmath>
#include <sstream>
#include <string>
#include <utility>

namespace pcl::mrf {
namespace {

OrientationVote chooseVote(const PointSet& points, const Options& options, const Report& report)
{
  if (!report.normalsEstimated && !report.signsOpposed)
    return report.normalsFilled > 0 ? OrientationVote::reference : OrientationVote::none;
  if (options.normals.source == NormalSource::reference && !points.normals.empty())
    return OrientationVote::reference;
  return points.sensors.empty() ? OrientationVote::outward : OrientationVote::sensor;
}

/// \param what what is known of the surface, and which side was taken
void warnOfGuess(const std::string& what, const Options& options, Report& report)
{
  report.warnings.push_back(
      what + "; give the sensor's position (RawCloud::sensors), a cloud that knows its sensor origin, or " +
      (options.normals.source == NormalSource::estimate ? "take its normals if it has good ones (normals.source = auto)"
                                                        : "normals"));
}

/// \param hidden share of points that cannot be seen from outside, if the inside was taken for that; else 0
void warnOfDisagreement(const PointSet& points, double hidden, const Options& options, Report& report)
{
  if (hidden > 0) {
    report.orientation.sideIsGuessed = true;
    return warnOfGuess("the points are spaced as a sensor amid them would space them, and " +
                           std::to_string(std::lround(100 * hidden)) +
                           " % can hardly be seen from outside: the inside of what they enclose was taken, which is a "
                           "guess",
                       options, report);
  }
  // If the side is a guess, the agreement of the votes means nothing.
  if (report.orientation.sideIsGuessed)
    return warnOfGuess("the surface is open (" + std::to_string(std::lround(100 * report.orientation.openShare)) +
                           " % of it encloses no volume), and nothing tells which side is the outside: the side that "
                           "was taken is a guess",
                       options, report);
  if (report.vote == OrientationVote::outward && !report.signsOpposed && isUneven(points)) {
    report.orientation.sideIsGuessed = true;
    return warnOfGuess("the points are spaced as a sensor amid them would space them, but nothing tells that they were "
                       "seen from within: the outside of what they enclose was taken, which is a guess",
                       options, report);
  }
  constexpr double lowAgreement = .75;
  // The outward vote is right for a surface that encloses a volume, even if many normals look inward, as in a mug.
  if (report.vote == OrientationVote::none || report.vote == OrientationVote::outward ||
      report.orientation.agreement >= lowAgreement)
    return;
  std::ostringstream text;
  text.precision(3);
  text << "only " << 100 * report.orientation.agreement << " % of the normals agree with the ";
  if (report.vote == OrientationVote::reference)
    text << "vote on their orientation; give sensor positions (RawCloud::sensors), or normals that point outward";
  else if (points.sensors.size() > 1 && points.views.empty())
    text << "nearest sensors; give the positions of all, and tell which of them saw each point (RawCloud::views)";
  else
    text << "sensors, which cannot have seen all points; give the positions of all sensors (RawCloud::sensors), or "
            "leave them out, a cloud's own by orientation.sensorOrigin = off";
  report.warnings.push_back(text.str());
}

/// σ of points without a given sensor, by a law of the range. \throw InvalidOption if no sensor was supposed either
std::vector<float> knownByRange(const NoiseLaw& law, const OrientedPoints& points, const Options& options,
                                Execution& execution)
{
  if (points.sensors.empty())
    throw InvalidOption("observation.noiseModel = " + options.observation.noiseModel +
                        " tells the noise by the range, and nothing tells where the sensor was; give its position "
                        "(RawCloud::sensors), or constant:S");
  return deviationsByLaw(law, points, execution);
}

void warnOfScatter(float cosine, Report& report)
{
  std::ostringstream text;
  text << "the normals are " << std::lround(std::acos(cosine) * 180 / EIGEN_PI)
       << " degrees (median) off planes as wide as the points' noise asks for: such were taken instead; "
          "normals.source = use keeps the cloud's";
  report.warnings.push_back(text.str());
}

} // namespace

OrientedPoints orientPoints(PreparedPoints prepared, const Options& options, NeighborSearch& search, Report& report,
                            Execution& execution)
{
  PointSet& points = prepared.points;
  const GivenSigns signs = !report.normalsEstimated && options.normals.source == NormalSource::automatic
                               ? judgeSigns(prepared, search, options, report, execution)
                               : GivenSigns::right;
  report.signsOpposed = signs != GivenSigns::right;
  report.vote = signs == GivenSigns::ofAxis ? OrientationVote::reference : chooseVote(points, options, report);
  if (signs == GivenSigns::ofAxis && points.normals.empty())
    points.normals = prepared.normals;
  report.sensorOriginUsed = report.vote == OrientationVote::sensor && points.hasSensorOrigin;
  OrientationResult oriented;
  {
    const StageTimer timer("orientation", report, execution);
    oriented =
        orientNormals(points, prepared.normals, search, report.density, report.vote, options.orientation, execution);
    report.orientation = oriented.summary();
  }
  const bool enclosesAll = report.vote == OrientationVote::outward && !oriented.sideIsGuessed;
  const double hidden =
      enclosesAll && signs != GivenSigns::mostlyInward ? hiddenOutside(points, oriented.normals, search) : 0;
  if (signs == GivenSigns::mostlyInward || hidden > 0)
    for (Eigen::Vector3f& normal : oriented.normals)
      normal = -normal;
  prepared.normals = std::vector<Eigen::Vector3f>(); // {} would keep their memory
  warnOfDisagreement(points, hidden, options, report);
  report.points.smallComponents = report.orientation.pointsDropped;
  if (!report.normalsEstimated && !report.signsOpposed && report.vote == OrientationVote::reference)
    for (std::size_t i = 0; i < points.size(); ++i)
      if (!points.normals[i].isZero()) // given normals stay as they are
        oriented.normals[i] = points.normals[i];
  points.normals = std::move(oriented.normals);
  reduce(points, oriented.keep, search, execution);
  report.sensorSupposed = options.orientation.sensorOrigin && points.sensors.empty() &&
                          isSeenFromOrigin(points.positions, points.normals, points.offset, execution);
  if (report.sensorSupposed) {
    points.sensors.emplace_back((-points.offset).cast<float>());
    if (options.outliers.alone) {
      std::vector<std::uint8_t> keep(points.size(), 1);
      report.points.mixedPixels = dropMixedPixels(points, search, keep, execution);
      reduce(points, keep, search, execution);
    }
  }
  requirePoints(points, report);
  report.points.used = static_cast<std::int64_t>(points.size());

  OrientedPoints result;
  static_cast<PointArrays&>(result) = std::move(points);
  if (const auto law = noiseLaw(options.observation.noiseModel); law && law->isByRange() && result.deviations.empty())
    result.deviations = knownByRange(*law, result, options, execution);
  return result;
}

void fitNormalsToNoise(OrientedPoints& points, const Options& options, NeighborSearch& search, Report& report,
                       Execution& execution)
{
  constexpr float alike = .93f; // cosine from which normals are kept
  if (options.normals.source == NormalSource::use || options.normals.noiseCriteria || options.normals.radius > 0)
    return;
  constexpr std::size_t few = 2048;
  const std::vector<std::uint32_t> asked = spreadIndices(points.size(), few);
  const auto fitsOf = [&](const std::vector<std::uint32_t>& places) {
    return estimateNormals(points, search, report.density.spacing, options.normals, execution, 0, places).normals;
  };
  const std::vector<Eigen::Vector3f> some = fitsOf(asked);
  std::vector<float> cosines;
  for (const std::uint32_t i : asked)
    cosines.push_back(std::abs(points.normals[i].dot(some[i])));
  const float cosine = quantile(std::move(cosines), .5);
  if (cosine > alike)
    return;
  const std::vector<Eigen::Vector3f> fits = fitsOf({});
  if (!report.normalsEstimated)
    warnOfScatter(cosine, report);
  PointSet set;
  static_cast<PointArrays&>(set) = std::move(points);
  if (report.vote == OrientationVote::none)
    report.vote = OrientationVote::reference;
  OrientationResult oriented =
      orientNormals(set, fits, search, report.density, report.vote, options.orientation, execution);
  report.orientation = oriented.summary();
  report.normalsEstimated = true;
  set.normals = std::move(oriented.normals);
  reduce(set, oriented.keep, search, execution);
  requirePoints(set, report);
  report.points.smallComponents += report.orientation.pointsDropped;
  report.points.used = static_cast<std::int64_t>(set.size());
  static_cast<PointArrays&>(points) = std::move(set);
}

} // namespace pcl::mrf
