// SPDX-License-Identifier: BSD-3-Clause
#include "points/sensor_view.h"

#include "base/loops.h"

#include <algorithm>
#include <numeric>

namespace pcl::mrf {
namespace {

/// Number of points next to a line of sight that are tested.
constexpr int besideSight = 12;

/// A point hides what is behind the disc of this radius around it, in its spacings. Those of a grid touch.
constexpr float opaque = .5f;

} // namespace

float clearance(float spacing, float deviation)
{
  constexpr float spacings = 10, deviations = 3;
  return spacings * spacing + deviations * deviation;
}

SensorView::SensorView(const Eigen::Vector3f& sensor, const std::vector<Eigen::Vector3f>& positions,
                       Execution& execution)
    : sensor_(sensor.cast<double>()), seen_(positions.size()), distances_(positions.size()), search_(makePointBins())
{
  const BoundingBox box = boundingBox(positions);
  radius_ = std::max((sensor_ - (box.lower + box.upper).cast<double>() / 2).norm(), double{box.diagonal()} / 2);
  forEach(execution, positions.size(), 4096, [&](std::size_t i) {
    seen_[i] = onSphere(positions[i]);
    distances_[i] = distance(positions[i]);
  });
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
  return static_cast<float>(radius_) / distance(position);
}

float SensorView::distance(const Eigen::Vector3f& position) const
{
  return static_cast<float>((position.cast<double>() - sensor_).norm());
}

bool SensorView::isBehindSome(const Eigen::Vector3f& position, float margin, const std::vector<float>& spacings,
                              const std::function<bool(std::size_t)>& counts, Neighbors& besides) const
{
  const float before = distance(position) - margin;
  const Eigen::Vector3f sight = onSphere(position);
  search_->nearest(sight, besideSight, besides);
  for (std::size_t n = 0; n < besides.indices.size(); ++n) {
    const std::size_t i = besides.indices[n];
    const float radius = opaque * spacings[i] * static_cast<float>(radius_) / distances_[i];
    if (distances_[i] < before && besides.squaredDistances[n] < radius * radius && counts(i))
      return true;
  }
  return false;
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

double hiddenShare(const PointArrays& points, const std::vector<float>& spacings, Execution& execution)
{
  constexpr std::size_t maxAsked = 2048, maxSensors = 8;
  std::vector<std::vector<std::uint32_t>> own = pointsOfSensors(points);
  std::vector<std::size_t> sensors(own.size()); // those that saw most come first
  std::iota(sensors.begin(), sensors.end(), 0);
  std::stable_sort(sensors.begin(), sensors.end(),
                   [&own](std::size_t a, std::size_t b) { return own[a].size() > own[b].size(); });
  sensors.resize(std::min(sensors.size(), maxSensors));
  double hidden = 0, all = 0;
  for (const std::size_t sensor : sensors) {
    const std::vector<std::uint32_t>& its = own[sensor];
    if (its.empty())
      break;
    const SensorView view(points.sensors[sensor], points.positions, execution);
    const std::size_t asked = std::min(its.size(), maxAsked / sensors.size());
    const auto isAny = [](std::size_t) { return true; };
    const double share = sumOver(execution, static_cast<std::int64_t>(asked), 64, [&](std::size_t n) {
      const std::size_t i = its[n * its.size() / asked];
      Neighbors besides;
      const float margin = clearance(spacings[i], points.deviations.empty() ? 0 : points.deviations[i]);
      return view.isBehindSome(points.positions[i], margin, spacings, isAny, besides) ? 1. : 0.;
    });
    hidden += share / static_cast<double>(asked) * static_cast<double>(its.size());
    all += static_cast<double>(its.size());
  }
  return all > 0 ? hidden / all : 0;
}

} // namespace pcl::mrf
