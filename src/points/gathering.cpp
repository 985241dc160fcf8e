// SPDX-License-Identifier: BSD-3-Clause
#include "points/gathering.h"

#include "base/select_values.h"
#include "base/spatial_sort.h"
#include "options/noise_law.h"
#include "points/noise.h"

#include <pcl/surface/mrf/option_table.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace pcl::mrf {
namespace {

/// Points per piece of parallel work.
constexpr std::int64_t gatheringGrain = 1 << 14;

bool isUsable(const Eigen::Vector3f& normal)
{
  return normal.allFinite() && normal.cast<double>().norm() > 1e-6;
}

/// \return whether at least one flagged point has a usable normal
bool hasUsableNormals(const std::vector<Eigen::Vector3f>& normals, const std::vector<std::uint8_t>& keep,
                      Execution& execution)
{
  return sumOver(execution, normals.size(), gatheringGrain,
                 [&](std::size_t i) { return keep[i] && isUsable(normals[i]) ? 1. : 0.; }) > 0;
}

/// Keeps the first of equal positions, with its origin. \pre equal positions are consecutive \return points dropped
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

/// Applies the option normals.source to the cloud. \return whether points without a normal have to be dropped
bool requireNormals(RawCloud& cloud, NormalSource source)
{
  if (source == NormalSource::estimate)
    cloud.normals = std::vector<Eigen::Vector3f>(); // {} would keep their memory
  else if (cloud.normals.empty() && source != NormalSource::automatic)
    throw InvalidOption("normals.source = " + nameOf(source) +
                        ", but the cloud has no normals; have them estimated (auto)");
  return source == NormalSource::use;
}

/// \throw InvalidOption if the noise is given both per point and by an option
void requireOneNoise(const RawCloud& cloud, const ObservationOptions& options)
{
  if (cloud.deviations.empty() || (!(options.noise > 0) && options.noiseModel == "automatic"))
    return;
  throw InvalidOption("each point has a noise of its own (noiseField, RawCloud::deviations), but " +
                      (options.noise > 0 ? "observation.noise = " + decimalText(static_cast<double>(options.noise))
                                         : "observation.noiseModel = " + options.noiseModel) +
                      " tells another one; give one of them");
}

/// The step between floats at the largest coordinate.
float resolutionOf(const BoundingBox& box)
{
  const float farthest = std::max(box.lower.cwiseAbs().maxCoeff(), box.upper.cwiseAbs().maxCoeff());
  return std::nextafter(farthest, std::numeric_limits<float>::infinity()) - farthest;
}

/// Brings values into the order of the points, applies `change` to each, and frees the given array.
template <typename Value, typename Change>
std::vector<Value> ordered(std::vector<Value>& values, const std::vector<std::uint32_t>& origins, Execution& execution,
                           const Change& change)
{
  std::vector<Value> result(values.empty() ? 0 : origins.size());
  forEach(execution, result.size(), gatheringGrain, [&](std::size_t n) { result[n] = change(values[origins[n]]); });
  values = std::vector<Value>();
  return result;
}

Eigen::Vector3f unitOrZero(const Eigen::Vector3f& vector)
{
  const Eigen::Vector3d normal = vector.cast<double>(); // its square may not fit a float
  const double length = normal.norm();
  return std::isfinite(length) && length > 0 ? Eigen::Vector3f((normal / length).cast<float>())
                                             : Eigen::Vector3f::Zero();
}

} // namespace

bool isImageFromZero(std::size_t width, std::size_t height, const std::function<Eigen::Vector3f(std::size_t)>& position)
{
  constexpr double most = .95, around = .5; // share of the pixels; length of the mean direction
  double right = 0, mirrored = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t row = 0; row + 1 < height; ++row)
    for (std::size_t column = 0; column + 1 < width; ++column) {
      const std::size_t i = row * width + column;
      const Eigen::Vector3d at = position(i).cast<double>();
      const double turn = at.dot(position(i + 1).cast<double>().cross(position(i + width).cast<double>()));
      right += turn > 0 ? 1 : 0;
      mirrored += turn < 0 ? 1 : 0;
      if (turn != 0 && std::isfinite(turn))
        sum += at.normalized();
    }
  const double all = right + mirrored;
  return right >= most * all || (mirrored >= most * all && sum.norm() < around * all);
}

std::vector<Eigen::Vector3d> sensorsOf(const RawCloud& cloud, const Options& options)
{
  if (cloud.sensors.empty() && cloud.sensorOrigin && options.orientation.sensorOrigin)
    return {*cloud.sensorOrigin};
  return cloud.sensors;
}

void validate(const RawCloud& cloud)
{
  const std::size_t points = cloud.positions.size();
  const auto require = [points](std::size_t values, const char* what) {
    if (values != 0 && values != points)
      throw InvalidInput("there are " + std::to_string(values) + " " + what + " for " + std::to_string(points) +
                         " points; there has to be one for each");
  };
  require(cloud.normals.size(), "normals");
  require(cloud.confidences.size(), "confidences");
  require(cloud.deviations.size(), "deviations of the noise");
  for (std::size_t i = 0; i < cloud.deviations.size(); ++i)
    if (const float deviation = cloud.deviations[i];
        (!(deviation > 0) || !std::isfinite(deviation)) && cloud.positions[i].allFinite()) // a missing pixel needs none
      throw InvalidInput("a point's noise has a deviation of " + decimalText(static_cast<double>(deviation)) +
                         " (noiseField, RawCloud::deviations); each has to be a number above 0: leave points without "
                         "one out of the cloud");
  require(cloud.views.size(), "views");
  for (const std::int32_t view : cloud.views)
    if (view < 0 || static_cast<std::size_t>(view) >= cloud.sensors.size())
      throw InvalidInput("a view names sensor " + std::to_string(view) + ", counted from 0; there are " +
                         std::to_string(cloud.sensors.size()));
}

PointSet gather(RawCloud cloud, const Options& options, PointCounts& counts, Execution& execution)
{
  requireCountable(cloud.positions.size());
  validate(cloud);
  requireOneNoise(cloud, options.observation);
  const bool normalsNeeded = requireNormals(cloud, options.normals.source);
  counts = PointCounts();
  counts.input = static_cast<std::int64_t>(cloud.positions.size());
  PointSet points;
  bool hasNormals = false;
  {
    std::vector<std::uint8_t> keep(cloud.positions.size(), 1);
    counts.notFinite = dropWhere(
        keep, [&](std::size_t i) { return !cloud.positions[i].allFinite(); }, execution);
    hasNormals = hasUsableNormals(cloud.normals, keep, execution);
    if (normalsNeeded && hasNormals)
      counts.zeroNormals = dropWhere(
          keep, [&](std::size_t i) { return !isUsable(cloud.normals[i]); }, execution);
    if (!cloud.confidences.empty())
      counts.zeroConfidence = dropWhere(
          keep, [&](std::size_t i) { return !std::isfinite(cloud.confidences[i]) || !(cloud.confidences[i] > 0); },
          execution);
    points.origins = spatialOrder(cloud.positions, keep, execution);
  }
  points.hadOnlyZeroNormals = !cloud.normals.empty() && !hasNormals;
  if (!hasNormals)
    cloud.normals = std::vector<Eigen::Vector3f>();

  // Each array is freed before the next one is ordered. The positions decide which points are left.
  points.positions = ordered(cloud.positions, points.origins, execution, [](const Eigen::Vector3f& p) { return p; });
  counts.duplicates = dropRepeated(points);
  counts.used = static_cast<std::int64_t>(points.origins.size());
  points.gathered = points.origins.size();
  points.normals = ordered(cloud.normals, points.origins, execution, unitOrZero);
  points.confidences =
      ordered(cloud.confidences, points.origins, execution, [](float value) { return std::min(value, 1.f); });
  points.deviations = ordered(cloud.deviations, points.origins, execution, [](float value) { return value; });
  points.views = ordered(cloud.views, points.origins, execution, [](std::int32_t view) { return view; });

  const BoundingBox box = boundingBox(points.positions);
  points.resolution = std::max(resolutionOf(box), cloud.resolution);
  const Eigen::Vector3d center = .5 * (box.lower.cast<double>() + box.upper.cast<double>());
  forEach(execution, points.size(), gatheringGrain,
          [&](std::size_t n) { points.positions[n] = (points.positions[n].cast<double>() - center).cast<float>(); });
  points.offset = cloud.offset + center;
  for (const Eigen::Vector3d& sensor : sensorsOf(cloud, options)) {
    requireSensor(sensor - points.offset, points.sensors.size());
    points.sensors.push_back((sensor - points.offset).cast<float>());
  }
  points.hasSensorOrigin = points.sensors.size() > cloud.sensors.size();
  if (const auto law = noiseLaw(options.observation.noiseModel))
    points.deviations = deviationsByLaw(*law, points, execution);
  return points;
}

} // namespace pcl::mrf
