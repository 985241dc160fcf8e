// SPDX-License-Identifier: BSD-3-Clause
#include "local_spacing.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace mrf_apps {

using Eigen::Vector3d;
using pcl::mrf::Execution;

namespace {

/// ½ over √(8/π): a circle around a point that reaches to the 8th other one holds eight at ρ points per area.
constexpr double halfSideByEighth = .313;

/// Queries per piece of parallel work.
constexpr std::int64_t grain = 1024;

} // namespace

LocalSpacing::LocalSpacing(const std::vector<Vector3d>& points, Execution& execution) : points_(points)
{
  findDistinct();
  Eigen::AlignedBox3d box;
  for (const Vector3d& point : points_)
    box.extend(point);
  if (distinct_.size() < static_cast<std::size_t>(pointsNeeded) || !std::isfinite(box.diagonal().norm()))
    return;
  center_ = box.center();
  diagonal_ = box.diagonal().norm();

  std::vector<Eigen::Vector3f> positions;
  positions.reserve(distinct_.size());
  for (const std::size_t point : distinct_)
    positions.push_back(inFrame(points_[point]));
  search_ = pcl::mrf::makePointBins();
  search_->setPoints(positions, execution);

  std::vector<double> ofDistinct(distinct_.size());
  execution.forRange(static_cast<std::int64_t>(distinct_.size()), grain, [&](std::int64_t begin, std::int64_t end) {
    pcl::mrf::Neighbors found;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
      ofDistinct[i] = spacingOf(i, found);
  });
  spacings_.reserve(points_.size());
  for (const std::size_t distinct : distinctOf_)
    spacings_.push_back(ofDistinct[distinct]);
}

void LocalSpacing::findDistinct()
{
  std::vector<std::size_t> order(points_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t i) {
    const Vector3d& x = points_[i];
    return std::make_tuple(x.x(), x.y(), x.z(), i);
  };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  distinctOf_.resize(points_.size());
  for (const std::size_t i : order) {
    if (distinct_.empty() || points_[distinct_.back()] != points_[i])
      distinct_.push_back(i);
    distinctOf_[i] = distinct_.size() - 1;
  }
}

Eigen::Vector3f LocalSpacing::inFrame(const Vector3d& place) const
{
  return ((place - center_) / diagonal_).cast<float>();
}

double LocalSpacing::spacingOf(std::size_t distinct, pcl::mrf::Neighbors& found) const
{
  const Vector3d& point = points_[distinct_[distinct]];
  const int count = search_->nearest(inFrame(point), pointsNeeded, found);
  std::vector<double> distances;
  for (std::size_t n = 0; n < static_cast<std::size_t>(count); ++n) {
    const auto other = static_cast<std::size_t>(found.indices[n]);
    if (other != distinct)
      distances.push_back((points_[distinct_[other]] - point).norm());
  }
  // Floats may order close ones otherwise, and may put nine others into the place of this one.
  std::sort(distances.begin(), distances.end());
  return halfSideByEighth * distances[pointsNeeded - 2];
}

std::vector<NearestPoint> LocalSpacing::nearest(const std::vector<Vector3d>& places, Execution& execution) const
{
  std::vector<NearestPoint> result(places.size());
  execution.forRange(static_cast<std::int64_t>(places.size()), grain, [&](std::int64_t begin, std::int64_t end) {
    pcl::mrf::Neighbors found;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      search_->nearest(inFrame(places[i]), 1, found);
      const std::size_t point = distinct_[static_cast<std::size_t>(found.indices[0])];
      result[i] = {(points_[point] - places[i]).norm(), point};
    }
  });
  return result;
}

} // namespace mrf_apps
