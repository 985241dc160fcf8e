// SPDX-License-Identifier: BSD-3-Clause
#include "select_values.h"
#include "spatial_sort.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/reconstruction.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace pcl {
namespace mrf {
namespace {

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
  std::vector<std::uint8_t> keep(positions.size(), 1);
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

} // namespace mrf
} // namespace pcl
