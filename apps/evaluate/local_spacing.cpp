// SPDX-License-Identifier: BSD-3-Clause
#include "local_spacing.h"

#include "support/float_offset.h"

#include <algorithm>
#include <cmath>

namespace mrf_apps {

using Eigen::Vector3d;
using pcl::mrf::Execution;

namespace {

/// ½ / √(8/π): a circle around a point that reaches to its 8th neighbor holds eight points at density ρ.
constexpr double halfSideByEighth = .313;

/// The point itself and eight neighbors.
constexpr int pointsNeeded = 9;

/// Queries per piece of parallel work.
constexpr std::int64_t grain = 1024;

} // namespace

LocalSpacing::LocalSpacing(std::vector<Vector3d> points, Execution& execution) : points_(std::move(points))
{
  std::sort(points_.begin(), points_.end(), [](const Vector3d& a, const Vector3d& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  });
  points_.erase(std::unique(points_.begin(), points_.end()), points_.end());
  const Eigen::AlignedBox3d box = boxOf(points_);
  if (points_.size() < pointsNeeded || !std::isfinite(box.diagonal().norm()))
    return;
  center_ = box.center();
  diagonal_ = box.diagonal().norm();
  std::vector<Eigen::Vector3f> positions;
  for (const Vector3d& point : points_)
    positions.push_back(inFrame(point));
  search_ = pcl::mrf::makePointBins();
  search_->setPoints(positions, execution);

  spacings_.resize(points_.size());
  execution.forRange(static_cast<std::int64_t>(points_.size()), grain, [&](std::int64_t begin, std::int64_t end) {
    pcl::mrf::Neighbors found;
    for (std::int64_t i = begin; i < end; ++i) {
      search_->nearest(positions[i], pointsNeeded, found);
      std::vector<double> distances;
      for (const int other : found.indices)
        if (other != i)
          distances.push_back((points_[other] - points_[i]).norm());
      // Floats may order close neighbors otherwise, and nine others may be found instead of the point itself.
      std::sort(distances.begin(), distances.end());
      spacings_[i] = halfSideByEighth * distances[pointsNeeded - 2];
    }
  });
}

Eigen::Vector3f LocalSpacing::inFrame(const Vector3d& place) const
{
  return ((place - center_) / diagonal_).cast<float>();
}

std::vector<LocalSpacing::Nearest> LocalSpacing::nearest(const std::vector<Vector3d>& places,
                                                         Execution& execution) const
{
  std::vector<Nearest> result(places.size());
  execution.forRange(static_cast<std::int64_t>(places.size()), grain, [&](std::int64_t begin, std::int64_t end) {
    pcl::mrf::Neighbors found;
    for (std::int64_t i = begin; i < end; ++i) {
      search_->nearest(inFrame(places[i]), 1, found);
      result[i] = {(points_[found.indices[0]] - places[i]).norm(), spacings_[found.indices[0]]};
    }
  });
  return result;
}

} // namespace mrf_apps
