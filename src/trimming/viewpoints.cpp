// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/viewpoints.h"

#include "base/select_values.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace pcl::mrf {
namespace {

using Eigen::Vector3d;

/// Max number of normals, spread evenly over the cloud, and of sensors. If there are more sensors, as of a scanner on
/// the move, those between see much the same.
constexpr std::size_t maxNormals = 10000, maxSensors = 256;

/// Share of the normals that count as those that turn away most. Where a sensor's view ends, normals are edge-on, all
/// around it, so that these tell its direction better than the mean of all normals does.
constexpr std::size_t turnedShare = 50; // one in

/// Min mean cosine of these normals to a direction of view. In single views their median (the first percentile of all
/// normals) was -.01 to .44; a second view 40° from the first, up to grazing angles of 80°, brings it to -.17.
constexpr double minTurned = -.1;

/// One in this many normals may turn away from all sensors, by a wrong sign; if more do, no sensor saw the points.
constexpr std::size_t wrongShare = 10;

/// Mean of the normals that turn away most from a direction.
Vector3d meanTurned(const std::vector<Vector3d>& normals, const Vector3d& direction,
                    std::vector<std::pair<double, std::size_t>>& scratch)
{
  scratch.clear();
  for (std::size_t n = 0; n < normals.size(); ++n)
    scratch.emplace_back(normals[n].dot(direction), n);
  const auto end = scratch.begin() + ((normals.size() + turnedShare - 1) / turnedShare);
  std::nth_element(scratch.begin(), end - 1, scratch.end());
  Vector3d sum = Vector3d::Zero();
  for (auto turned = scratch.begin(); turned < end; ++turned)
    sum += normals[turned->second];
  return sum / static_cast<double>(end - scratch.begin());
}

/// The direction with the largest mean cosine of the normals that turn away from it most: a concave function, which is
/// maximized by its subgradients. Nothing if that cosine is below minTurned.
std::optional<Eigen::Vector3f> commonDirection(const std::vector<Eigen::Vector3f>& all)
{
  constexpr int steps = 100;
  if (all.empty())
    return std::nullopt;
  std::vector<Vector3d> normals;
  for (const std::uint32_t i : spreadIndices(all.size(), maxNormals))
    normals.push_back(all[i].cast<double>());
  Vector3d direction = Vector3d::Zero();
  for (const Vector3d& normal : normals)
    direction += normal;
  direction.normalize();
  std::vector<std::pair<double, std::size_t>> scratch;
  for (int step = 0; step < steps; ++step)
    direction = (direction + .1 * (1 - static_cast<double>(step) / steps) * meanTurned(normals, direction, scratch))
                    .normalized();
  if (!(meanTurned(normals, direction, scratch).dot(direction) >= minTurned))
    return std::nullopt;
  return direction.cast<float>();
}

} // namespace

Viewpoints::Viewpoints(const OrientedPoints& points)
{
  if (points.sensors.empty()) {
    direction_ = commonDirection(points.normals);
    return;
  }
  for (const std::uint32_t sensor : spreadIndices(points.sensors.size(), maxSensors))
    sensors_.push_back(points.sensors[sensor]);
  std::size_t turned = 0;
  const std::vector<std::uint32_t> picked = spreadIndices(points.size(), maxNormals);
  for (const std::uint32_t i : picked)
    turned += facing(points.positions[i], points.normals[i]) < minTurned ? 1 : 0;
  if (wrongShare * turned > picked.size())
    sensors_.clear();
}

bool Viewpoints::areKnown() const
{
  return direction_ || !sensors_.empty();
}

float Viewpoints::facing(const Eigen::Vector3f& position, const Eigen::Vector3f& normal) const
{
  if (direction_)
    return normal.dot(*direction_);
  float facing = -1;
  for (const Eigen::Vector3f& sensor : sensors_)
    facing = std::max(facing, normal.dot((sensor - position).normalized()));
  return facing;
}

} // namespace pcl::mrf
