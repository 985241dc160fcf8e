// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/lines_of_sight.h"

#include <pcl/surface/mrf/neighbor_search.h>

#include "base/loops.h"

#include <algorithm>
#include <memory>

namespace pcl {
namespace mrf {
namespace {

/// As far as a point stands for the surface around it, in its spacings.
constexpr float cover = 2;

/// Points next to a line of sight that are looked at. More than one, because at a silhouette the nearest may lie
/// behind.
constexpr int besideSight = 12;

/// Of more sensors, as of a scanner on the move, it would take too long to ask each what it saw through.
constexpr std::size_t maxViews = 256;

/// The points as a sensor sees them: moved along their lines of sight onto a sphere around it, where what is in front
/// of a place is next to it. The sphere is as large as the cloud is far, so that far sensors tell points apart, too.
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

  Sight look(const Place& place, Neighbors& besides) const
  {
    const Eigen::Vector3d sight = place.position.cast<double>() - sensor_;
    const auto distance = static_cast<float>(sight.norm());
    const Eigen::Vector3f direction = sight.normalized().cast<float>();
    const int found = search_->nearest(onSphere(place.position), besideSight, besides);
    const bool isOnly = points_.sensors.size() == 1; // no other can have seen the points
    Sight result = Sight::free;
    for (int n = 0; n < found; ++n) {
      const std::size_t i = besides.indices[n];
      // Where the line of sight meets the point's tangent plane, seen from the place.
      const Eigen::Vector3f point = points_.positions[i] - place.position;
      const float facing = points_.normals[i].dot(direction);
      const float behind = points_.normals[i].dot(point) / facing; // if not finite: beside
      const bool hides = -behind > place.margin && -behind < distance;
      const bool isSeenThrough = isOnly && facing < 0 && behind > place.margin;
      if (!(hides || isSeenThrough) || !((behind * direction - point).norm() < cover * points_.spacings[i]))
        continue;
      if (isSeenThrough)
        return Sight::through;
      result = Sight::hidden;
    }
    return result;
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

std::vector<Sight> lookAt(const std::vector<Place>& places, const OrientedPoints& points, Execution& execution)
{
  std::vector<Sight> result(places.size(), points.sensors.empty() ? Sight::free : Sight::hidden);
  const auto ask = [&](const View& view, const auto& decide) {
    execution.forRange(places.size(), 256, [&](std::size_t begin, std::size_t end) {
      Neighbors besides;
      for (std::size_t n = begin; n < end; ++n)
        decide(result[n], [&] { return view.look(places[n], besides); });
    });
  };
  for (const Eigen::Vector3f& sensor : points.sensors) {
    if (std::find(result.begin(), result.end(), Sight::hidden) == result.end())
      break;
    ask(View(sensor, points, execution), [](Sight& sight, const auto& look) {
      if (sight == Sight::hidden)
        sight = look();
    });
  }
  if (points.sensors.size() < 2 || points.sensors.size() > maxViews || points.views.empty() || places.empty())
    return result;
  for (std::size_t sensor = 0; sensor < points.sensors.size(); ++sensor) {
    std::vector<std::uint32_t> own;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (points.views[i] == static_cast<std::int32_t>(sensor))
        own.push_back(static_cast<std::uint32_t>(i));
    if (own.empty())
      continue;
    OrientedPoints seen = select(points, own);
    seen.sensors = {points.sensors[sensor]};
    ask(View(seen.sensors.front(), seen, execution), [](Sight& sight, const auto& look) {
      if (sight != Sight::through && look() == Sight::through)
        sight = Sight::through;
    });
  }
  return result;
}

} // namespace mrf
} // namespace pcl
