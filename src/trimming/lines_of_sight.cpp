// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/lines_of_sight.h"

#include "points/sensor_view.h"

#include <algorithm>

namespace pcl::mrf {
namespace {

/// Radius of the surface for which a point stands, in its spacings.
constexpr float cover = 2;

/// Number of points next to a line of sight that are tested. More than one, because at a silhouette the nearest may be
/// behind.
constexpr int besideSight = 12;

/// Max number of sensors. More, as of a scanner on the move, would take too long.
constexpr std::size_t maxViews = 256;

/// What one sensor saw.
class View {
public:
  View(const Eigen::Vector3f& sensor, const OrientedPoints& points, Execution& execution)
      : sensor_(sensor.cast<double>()), points_(points), view_(sensor, points.positions, execution)
  {}

  bool seesThrough(const Place& place, Neighbors& besides) const
  {
    const Eigen::Vector3f direction = (place.position.cast<double>() - sensor_).normalized().cast<float>();
    view_.search().nearest(view_.onSphere(place.position), besideSight, besides);
    return std::any_of(besides.indices.begin(), besides.indices.end(), [&](std::size_t i) {
      // Where the line of sight meets the point's tangent plane, seen from the place.
      const Eigen::Vector3f point = points_.positions[i] - place.position;
      const float facing = points_.normals[i].dot(direction);
      const float behind = points_.normals[i].dot(point) / facing; // not finite if parallel: no hit
      return facing < 0 && behind > place.margin && (behind * direction - point).norm() < cover * points_.spacings[i];
    });
  }

  /// Whether this sensor saw more points of larger surfaces through the disc around a point than points at the disc.
  /// \param own indices of the points of this view \param number of the point's surface
  bool passesThrough(std::uint32_t point, const OrientedPoints& all, const std::vector<std::uint32_t>& own,
                     const Surfaces& surfaces, std::int32_t number, Neighbors& besides) const
  {
    const Eigen::Vector3f& position = all.positions[point];
    const float behind = view_.distance(position) + clearance(all.spacings[point], all.deviation(point));
    view_.search().within(view_.onSphere(position), all.spacings[point] * view_.scaleAt(position), besides);
    int through = 0, stopped = 0;
    for (const int i : besides.indices)
      if (view_.distance(points_.positions[i]) <= behind)
        ++stopped;
      else if (surfaces.isLarger(own[i], number))
        ++through;
    return through >= 2 * (stopped + 1);
  }

  /// Whether one of this sensor's points lies behind a point of a larger surface.
  bool isBehind(std::size_t point, const std::vector<std::uint32_t>& own, const Surfaces& surfaces, std::int32_t number,
                Neighbors& besides) const
  {
    return view_.isBehindSome(
        points_.positions[point], clearance(points_.spacings[point], points_.deviation(point)), points_.spacings,
        [&](std::size_t i) { return surfaces.isLarger(own[i], number); }, besides);
  }

private:
  const Eigen::Vector3d sensor_;
  const OrientedPoints& points_;
  const SensorView view_;
};

/// Flags of the numbers below `count` that pass a test in the view of some sensor.
/// \param test called with a view, the indices of its points, a number and scratch
template <typename Test>
std::vector<std::uint8_t> flagsOf(std::size_t count, const OrientedPoints& points, Execution& execution,
                                  const Test& test)
{
  std::vector<std::uint8_t> flags(count, 0);
  if (count == 0 || points.sensors.size() > maxViews)
    return flags;
  const std::vector<std::vector<std::uint32_t>> own = pointsOfSensors(points);
  for (std::size_t sensor = 0; sensor < own.size(); ++sensor) {
    if (own[sensor].empty())
      continue;
    const bool isAll = own[sensor].size() == points.size();
    const OrientedPoints some = isAll ? OrientedPoints() : select(points, own[sensor]);
    const View view(points.sensors[sensor], isAll ? points : some, execution);
    execution.forRange(count, 64, [&](std::size_t begin, std::size_t end) {
      Neighbors besides;
      for (std::size_t n = begin; n < end; ++n)
        if (!flags[n])
          flags[n] = test(view, own[sensor], n, besides) ? 1 : 0;
    });
  }
  return flags;
}

} // namespace

std::vector<std::uint8_t> seenThrough(const std::vector<Place>& places, const OrientedPoints& points,
                                      Execution& execution)
{
  return flagsOf(places.size(), points, execution,
                 [&](const View& view, const std::vector<std::uint32_t>&, std::size_t n, Neighbors& besides) {
                   return view.seesThrough(places[n], besides);
                 });
}

std::vector<std::uint8_t> contradicted(const std::vector<std::uint32_t>& asked, const Surfaces& surfaces,
                                       const OrientedPoints& points, Execution& execution)
{
  const auto isContradicted = [&](const View& view, const std::vector<std::uint32_t>& own, std::size_t n,
                                  Neighbors& besides) {
    const std::uint32_t point = asked[n];
    const std::int32_t number = surfaces.numberOf(point);
    if (number < 0)
      return false;
    const auto found = std::lower_bound(own.begin(), own.end(), point); // own is in ascending order
    const bool isOwn = found != own.end() && *found == point;
    return view.passesThrough(point, points, own, surfaces, number, besides) ||
           (isOwn && view.isBehind(static_cast<std::size_t>(found - own.begin()), own, surfaces, number, besides));
  };
  return flagsOf(asked.size(), points, execution, isContradicted);
}

} // namespace pcl::mrf
