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

private:
  const Eigen::Vector3d sensor_;
  const OrientedPoints& points_;
  const SensorView view_;
};

} // namespace

std::vector<std::uint8_t> seenThrough(const std::vector<Place>& places, const OrientedPoints& points,
                                      Execution& execution)
{
  std::vector<std::uint8_t> result(places.size(), 0);
  if (places.empty() || points.sensors.size() > maxViews)
    return result;
  const std::vector<std::vector<std::uint32_t>> own = pointsOfSensors(points);
  for (std::size_t sensor = 0; sensor < own.size(); ++sensor) {
    if (own[sensor].empty())
      continue;
    const bool isAll = own[sensor].size() == points.size();
    const OrientedPoints some = isAll ? OrientedPoints() : select(points, own[sensor]);
    const OrientedPoints& seen = isAll ? points : some;
    const View view(points.sensors[sensor], seen, execution);
    execution.forRange(places.size(), 256, [&](std::size_t begin, std::size_t end) {
      Neighbors besides;
      for (std::size_t n = begin; n < end; ++n)
        if (!result[n])
          result[n] = view.seesThrough(places[n], besides) ? 1 : 0;
    });
  }
  return result;
}

} // namespace pcl::mrf
