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

/// The points as a sensor sees them: moved along their lines of sight onto a sphere around it, where what is in front
/// of a place is next to it. The sphere is as large as the cloud is far, so that far sensors tell points apart, too.
class View {
public:
  View(std::size_t sensor, const OrientedPoints& points, Execution& execution)
      : number_(sensor), sensor_(points.sensors[sensor].cast<double>()), points_(points), search_(makePointBins())
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
    Sight result = Sight::free;
    for (int n = 0; n < found; ++n) {
      const std::size_t i = besides.indices[n];
      // Where the line of sight meets the point's tangent plane, seen from the place.
      const Eigen::Vector3f point = points_.positions[i] - place.position;
      const float facing = points_.normals[i].dot(direction);
      const float behind = points_.normals[i].dot(point) / facing; // if not finite: beside
      const bool hides = -behind > place.margin && -behind < distance;
      const bool isSeenThrough = facing < 0 && behind > place.margin && isOfThis(i);
      if (!(hides || isSeenThrough) || !((behind * direction - point).norm() < cover * points_.spacings[i]))
        continue;
      if (isSeenThrough)
        return Sight::through;
      result = Sight::hidden;
    }
    return result;
  }

private:
  /// Whether this sensor is known to have seen a point.
  bool isOfThis(std::size_t i) const
  {
    return points_.sensors.size() == 1 || (!points_.views.empty() && points_.views[i] == static_cast<int>(number_));
  }

  Eigen::Vector3f onSphere(const Eigen::Vector3f& position) const
  {
    const Eigen::Vector3d sight = position.cast<double>() - sensor_;
    const double distance = sight.norm();
    if (!(distance > 0))
      return position;
    return (position.cast<double>() + sight * ((radius_ - distance) / distance)).cast<float>();
  }

  const std::size_t number_;
  const Eigen::Vector3d sensor_;
  const OrientedPoints& points_;
  double radius_;
  std::unique_ptr<NeighborSearch> search_;
};

} // namespace

std::vector<Sight> lookAt(const std::vector<Place>& places, const OrientedPoints& points, Execution& execution)
{
  const bool knowsViews = points.sensors.size() == 1 || !points.views.empty();
  std::vector<Sight> result(places.size(), points.sensors.empty() ? Sight::free : Sight::hidden);
  const auto isDecided = [&](Sight sight) { return sight == Sight::through || (sight == Sight::free && !knowsViews); };
  for (std::size_t sensor = 0; sensor < points.sensors.size(); ++sensor) {
    if (std::all_of(result.begin(), result.end(), isDecided))
      break;
    const View view(sensor, points, execution);
    execution.forRange(places.size(), 256, [&](std::size_t begin, std::size_t end) {
      Neighbors besides;
      for (std::size_t n = begin; n < end; ++n)
        if (!isDecided(result[n])) {
          const Sight sight = view.look(places[n], besides);
          if (sight != Sight::hidden)
            result[n] = sight == Sight::through ? sight : Sight::free;
        }
    });
  }
  return result;
}

} // namespace mrf
} // namespace pcl
