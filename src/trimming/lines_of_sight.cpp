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
  View(const Eigen::Vector3f& sensor, const OrientedPoints& points, Execution& execution)
      : sensor_(sensor.cast<double>()), points_(points), search_(makePointBins())
  {
    const BoundingBox box = boundingBox(points.positions);
    radius_ = (sensor_ - (box.lower + box.upper).cast<double>() / 2).norm();
    std::vector<Eigen::Vector3f> seen(points.size());
    forEach(execution, points.size(), 4096, [&](std::size_t i) { seen[i] = onSphere(points.positions[i]); });
    search_->setPoints(seen, execution);
  }

  /// \param isOnly no other sensor can have seen the points
  bool denies(const Place& place, bool isOnly, Neighbors& besides) const
  {
    const Eigen::Vector3d sight = place.position.cast<double>() - sensor_;
    const auto distance = static_cast<float>(sight.norm());
    const Eigen::Vector3f direction = sight.normalized().cast<float>();
    const int found = search_->nearest(onSphere(place.position), besideSight, besides);
    for (int n = 0; n < found; ++n) {
      const std::size_t i = besides.indices[n];
      // Where the line of sight meets the point's tangent plane, seen from the place.
      const Eigen::Vector3f point = points_.positions[i] - place.position;
      const float facing = points_.normals[i].dot(direction);
      const float behind = points_.normals[i].dot(point) / facing; // if not finite: beside
      const bool hides = -behind > place.margin && -behind < distance;
      const bool isSeenThrough = isOnly && facing < 0 && behind > place.margin;
      if ((hides || isSeenThrough) && (behind * direction - point).norm() < cover * points_.spacings[i])
        return true;
    }
    return false;
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

std::vector<std::uint8_t> findDenied(const std::vector<Place>& places, const OrientedPoints& points,
                                     Execution& execution)
{
  const bool isOnly = points.sensors.size() == 1;
  std::vector<std::uint8_t> isDenied(places.size(), points.sensors.empty() ? 0 : 1);
  for (const Eigen::Vector3f& sensor : points.sensors) {
    if (std::find(isDenied.begin(), isDenied.end(), std::uint8_t{1}) == isDenied.end())
      break;
    const View view(sensor, points, execution);
    execution.forRange(places.size(), 256, [&](std::size_t begin, std::size_t end) {
      Neighbors besides;
      for (std::size_t n = begin; n < end; ++n)
        if (isDenied[n])
          isDenied[n] = view.denies(places[n], isOnly, besides) ? 1 : 0;
    });
  }
  return isDenied;
}

} // namespace mrf
} // namespace pcl
