// SPDX-License-Identifier: BSD-3-Clause
#include "points/ghost_points.h"

#include "base/loops.h"
#include "base/select_values.h"
#include "points/sensor_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pcl::mrf {
namespace {

/// Max number of sensors. More, as of a scanner on the move, would see too little each.
constexpr std::size_t maxSensors = 256;

/// Cosine between line of sight and normal. A sensor that sees a point at a more grazing angle does not count.
constexpr float grazing = .2f;

/// What is farther away than a point is so by more than this many of its spacings.
constexpr float apart = 5;

/// The ranges that a sensor measured, in cells of about 1.5°: those of a grid on each face of a cube around it.
class Panorama {
public:
  Panorama(const Eigen::Vector3f& sensor, const std::vector<Eigen::Vector3f>& positions,
           const std::vector<std::uint32_t>& seen)
      : sensor_(sensor), nearest_(6 * cells * cells, std::numeric_limits<float>::infinity()),
        farthest_(nearest_.size(), 0)
  {
    for (const std::uint32_t i : seen) {
      const Eigen::Vector3f sight = positions[i] - sensor_;
      const std::size_t cell = cellOf(sight);
      nearest_[cell] = std::min(nearest_[cell], sight.norm());
      farthest_[cell] = std::max(farthest_[cell], sight.norm());
    }
  }

  /// 1: all that the sensor saw around the line of sight to a point is farther away. −1: something is at its range.
  /// 0: neither, or a grazing angle.
  int seesThrough(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, float spacing) const
  {
    const Eigen::Vector3f sight = position - sensor_;
    const float range = sight.norm(), cosine = std::abs(sight.dot(normal)) / range;
    const std::size_t cell = cellOf(sight);
    if (!(cosine > grazing) || farthest_[cell] == 0)
      return 0;
    // Within half a cell, the point's own plane gets farther by so much.
    const float slope = range * angle / 2 * std::sqrt(1 - std::min(cosine * cosine, 1.f)) / cosine,
                margin = apart * spacing + slope;
    return nearest_[cell] > range + margin ? 1 : farthest_[cell] >= range - margin ? -1 : 0;
  }

private:
  static constexpr std::size_t cells = 60; ///< along the edge of a face
  static constexpr float angle = static_cast<float>(EIGEN_PI) / 2 / cells;

  static std::size_t cellOf(const Eigen::Vector3f& sight)
  {
    Eigen::Index axis = 0;
    const float largest = sight.cwiseAbs().maxCoeff(&axis);
    const auto along = [&](Eigen::Index other) {
      const float part = largest > 0 ? sight[(axis + other) % 3] / largest : 0; // from −1 to 1
      return std::min(static_cast<std::size_t>((part + 1) / 2 * cells), cells - 1);
    };
    const std::size_t face = 2 * static_cast<std::size_t>(axis) + (sight[axis] < 0 ? 1 : 0);
    return (face * cells + along(1)) * cells + along(2);
  }

  const Eigen::Vector3f sensor_;
  std::vector<float> nearest_, farthest_;
};

/// Numbers of sensors that saw through a point, and that saw something at its range.
struct Sights {
  int through = 0, stopped = 0;
};

std::vector<Sights> countSights(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                                Execution& execution)
{
  std::vector<Sights> sights(points.size());
  const std::vector<std::vector<std::uint32_t>> own = pointsOfSensors(points);
  for (std::size_t s = 0; s < own.size(); ++s) {
    if (own[s].empty())
      continue;
    const Panorama panorama(points.sensors[s], points.positions, own[s]);
    forEach(execution, points.size(), 4096, [&](std::size_t i) {
      if (points.views[i] == static_cast<std::int32_t>(s))
        return;
      const int sees = panorama.seesThrough(points.positions[i], normals[i], points.spacings[i]);
      sights[i].through += sees > 0 ? 1 : 0;
      sights[i].stopped += sees < 0 ? 1 : 0;
    });
  }
  return sights;
}

} // namespace

std::int64_t dropGhosts(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                        const NeighborSearch& search, std::vector<std::uint8_t>& keep, Execution& execution)
{
  constexpr int neighbors = 17; // with the point itself
  if (points.views.empty() || points.sensors.size() < 3 || points.sensors.size() > maxSensors)
    return 0;
  const std::vector<Sights> sights = countSights(points, normals, execution);
  return dropWhere(
      keep,
      [&](std::size_t i) {
        if (sights[i].through == 0)
          return false;
        Neighbors nearest;
        search.nearest(points.positions[i], neighbors, nearest);
        Sights sum;
        for (const std::size_t other : nearest.indices) {
          sum.through += sights[other].through;
          sum.stopped += sights[other].stopped;
        }
        return sum.through >= neighbors + 2 * sum.stopped;
      },
      execution);
}

} // namespace pcl::mrf
