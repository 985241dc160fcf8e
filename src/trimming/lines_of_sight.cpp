// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/lines_of_sight.h"

#include <pcl/surface/mrf/neighbor_search.h>

#include "base/loops.h"

#include <algorithm>
#include <memory>

namespace pcl::mrf {
namespace {

/// As far as a point stands for the surface around it, in its spacings.
constexpr float cover = 2;

/// Points next to a line of sight that are looked at. More than one, because at a silhouette the nearest may lie
/// behind.
constexpr int besideSight = 12;

/// Of more sensors, as of a scanner on the move, it would take too long to ask each what it saw through.
constexpr std::size_t maxViews = 256;

/// The points as a sensor sees them: moved along their lines of sight onto a sphere around it, where what is behind a
/// place is next to it. The sphere is as large as the cloud is far, so that far sensors tell points apart, too.
class View {
public:
  View(const Eigen::Vector3f& sensor, const OrientedPoints& points, Execution& execution)
      : sensor_(sensor.cast<double>()), points_(points), search_(makePointBins())
  {
    const BoundingBox box = boundingBox(points.positions);
    radius_ = (sensor_ - (box.lower + box.upper).cast<double>() / 2).norm();
    std::vector<Eigen::Vector3f> seen(points.size());
    forEach(execution, points.size(), 4096, [&](std::size_t i) { seen[i] = onSphere(points.positions[i]); });
    search_->setPoints(seen, execution);
  }

  bool seesThrough(const Place& place, Neighbors& besides) const
  {
    const Eigen::Vector3f direction = (place.position.cast<double>() - sensor_).normalized().cast<float>();
    search_->nearest(onSphere(place.position), besideSight, besides);
    return std::any_of(besides.indices.begin(), besides.indices.end(), [&](std::size_t i) {
      // Where the line of sight meets the point's tangent plane, seen from the place.
      const Eigen::Vector3f point = points_.positions[i] - place.position;
      const float facing = points_.normals[i].dot(direction);
      const float behind = points_.normals[i].dot(point) / facing; // if not finite: beside
      return facing < 0 && behind > place.margin && (behind * direction - point).norm() < cover * points_.spacings[i];
    });
  }

private:
  Eigen::Vector3f onSphere(const Eigen::Vector3f& position) const
  {
    const Eigen::Vector3d sight = position.cast<double>() - sensor_;
    const double distance = sight.norm();
    if (!(distance > 0))
      return position;
    return (position.cast<double>() + sight * ((radius_ - distance) / distance)).cast<float>();
  }

  const Eigen::Vector3d sensor_;
  const OrientedPoints& points_;
  double radius_;
  std::unique_ptr<NeighborSearch> search_;
};

} // namespace

std::vector<std::uint8_t> seenThrough(const std::vector<Place>& places, const OrientedPoints& points,
                                      Execution& execution)
{
  std::vector<std::uint8_t> result(places.size(), 0);
  const bool isOnly = points.sensors.size() == 1; // no other can have seen the points
  if (places.empty() || points.sensors.size() > maxViews || (points.views.empty() && !isOnly))
    return result;
  for (std::size_t sensor = 0; sensor < points.sensors.size(); ++sensor) {
    OrientedPoints own;
    if (!isOnly) {
      std::vector<std::uint8_t> isOwn(points.size());
      for (std::size_t i = 0; i < isOwn.size(); ++i)
        isOwn[i] = points.views[i] == static_cast<std::int32_t>(sensor) ? 1 : 0;
      own = select(points, isOwn);
    }
    const OrientedPoints& seen = isOnly ? points : own;
    if (seen.size() == 0)
      continue;
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
