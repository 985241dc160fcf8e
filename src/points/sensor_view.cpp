// SPDX-License-Identifier: BSD-3-Clause
#include "points/sensor_view.h"

#include "base/loops.h"

#include <numeric>

namespace pcl::mrf {

SensorView::SensorView(const Eigen::Vector3f& sensor, const std::vector<Eigen::Vector3f>& positions,
                       Execution& execution)
    : sensor_(sensor.cast<double>()), seen_(positions.size()), search_(makePointBins())
{
  const BoundingBox box = boundingBox(positions);
  radius_ = (sensor_ - (box.lower + box.upper).cast<double>() / 2).norm();
  forEach(execution, positions.size(), 4096, [&](std::size_t i) { seen_[i] = onSphere(positions[i]); });
  search_->setPoints(seen_, execution);
}

Eigen::Vector3f SensorView::onSphere(const Eigen::Vector3f& position) const
{
  const Eigen::Vector3d sight = position.cast<double>() - sensor_;
  const double distance = sight.norm();
  if (!(distance > 0))
    return position;
  return (position.cast<double>() + sight * ((radius_ - distance) / distance)).cast<float>();
}

float SensorView::scaleAt(const Eigen::Vector3f& position) const
{
  return static_cast<float>(radius_ / (position.cast<double>() - sensor_).norm());
}

std::vector<std::vector<std::uint32_t>> pointsOfSensors(const PointArrays& points)
{
  std::vector<std::vector<std::uint32_t>> own(points.sensors.size());
  if (own.size() == 1) { // no other can have seen the points
    own.front().resize(points.size());
    std::iota(own.front().begin(), own.front().end(), 0);
  } else
    for (std::uint32_t i = 0; i < points.views.size(); ++i)
      if (const std::int32_t view = points.views[i]; view >= 0 && static_cast<std::size_t>(view) < own.size())
        own[static_cast<std::size_t>(view)].push_back(i);
  return own;
}

} // namespace pcl::mrf
