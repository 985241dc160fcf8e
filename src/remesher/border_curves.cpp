// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/border_curves.h"

#include <algorithm>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

/// Each step moves a vertex toward the middle of both neighbors, then a little farther back, so that long waves keep
/// their size (Taubin, A signal processing approach to fair surface design, 1995). Waves of 2, 4 and 8 edges keep 0, 7
/// and 87 % of their height, a circle of 12 edges 99 % of its radius.
constexpr int smoothingSteps = 10;
constexpr float forth = .5f, back = -.5263f;

std::vector<Vector3f> smoothed(const std::vector<Vector3f>& loop, float maxShift)
{
  const std::size_t count = loop.size();
  std::vector<Vector3f> nodes = loop, next(count);
  for (int step = 0; step < 2 * smoothingSteps; ++step) {
    const float share = step % 2 == 0 ? forth : back;
    for (std::size_t n = 0; n < count; ++n)
      next[n] = nodes[n] + share * (.5f * (nodes[(n + count - 1) % count] + nodes[(n + 1) % count]) - nodes[n]);
    nodes.swap(next);
  }
  for (std::size_t n = 0; n < count; ++n) {
    const Vector3f shift = nodes[n] - loop[n];
    const float length = shift.norm();
    if (length > maxShift)
      nodes[n] = loop[n] + maxShift / length * shift;
  }
  return nodes;
}

float squaredDistance(const Vector3f& p, const Vector3f& start, const Vector3f& end)
{
  const Vector3f along = end - start, from = p - start;
  const float squaredLength = along.squaredNorm();
  const float share = squaredLength > 0 ? std::clamp(from.dot(along) / squaredLength, 0.f, 1.f) : 0.f;
  return (from - share * along).squaredNorm();
}

} // namespace

BorderCurves::BorderCurves(const std::vector<Vector3f>& positions, const std::vector<std::int32_t>& next,
                           float maxShift, const OnSurface& onSurface, std::vector<double>& places)
{
  for (std::size_t start = 0; start < next.size(); ++start) {
    if (next[start] < 0)
      continue;
    if (places.empty())
      places.assign(positions.size(), -1);
    if (places[start] >= 0)
      continue;
    std::vector<std::int32_t> loop(1, static_cast<std::int32_t>(start));
    while (next[loop.back()] != loop.front())
      loop.push_back(next[loop.back()]);
    addLoop(positions, loop, maxShift, onSurface, places);
  }
}

void BorderCurves::addLoop(const std::vector<Vector3f>& positions, const std::vector<std::int32_t>& loop,
                           float maxShift, const OnSurface& onSurface, std::vector<double>& places)
{
  std::vector<Vector3f> own;
  own.reserve(loop.size());
  for (const std::int32_t v : loop)
    own.push_back(positions[v]);
  std::vector<Vector3f> course = smoothed(own, maxShift);
  for (std::size_t n = 0; n < course.size(); ++n)
    if (!onSurface(course[n]))
      course[n] = own[n];
  course.push_back(course.front());

  firstNodes_.push_back(nodes_.size());
  double place = starts_.empty() ? 0 : starts_.back() + maxShift;
  for (std::size_t n = 0; n < course.size(); ++n) {
    // Nodes may coincide, but their places must differ: places give the order of the vertices.
    if (n > 0)
      place += std::max((course[n] - course[n - 1]).norm(), 1e-3f * maxShift);
    starts_.push_back(place);
    nodes_.push_back(course[n]);
    if (n < loop.size())
      places[loop[n]] = place;
  }
}

std::size_t BorderCurves::nodeBefore(double place) const
{
  const auto after = std::upper_bound(starts_.begin(), starts_.end(), place);
  const auto node = static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - starts_.begin() - 1, 0));
  return std::min(node, starts_.size() - 2);
}

BorderCurves::Loop BorderCurves::loopOf(double place) const
{
  const auto after = std::upper_bound(firstNodes_.begin(), firstNodes_.end(), nodeBefore(place));
  return {*(after - 1), (after == firstNodes_.end() ? nodes_.size() : *after) - 1};
}

double BorderCurves::lengthOn(const Loop& loop, double from, double to) const
{
  return to > from ? to - from : to - from + starts_[loop.last] - starts_[loop.first];
}

Vector3f BorderCurves::at(double place) const
{
  const std::size_t node = nodeBefore(place);
  const double share = (place - starts_[node]) / (starts_[node + 1] - starts_[node]);
  return nodes_[node] + static_cast<float>(std::clamp(share, 0., 1.)) * (nodes_[node + 1] - nodes_[node]);
}

double BorderCurves::between(double from, double to, double share) const
{
  const Loop loop = loopOf(from);
  const double place = from + share * lengthOn(loop, from, to);
  return place < starts_[loop.last] ? place : place - starts_[loop.last] + starts_[loop.first];
}

double BorderCurves::share(double from, double place, double to) const
{
  const Loop loop = loopOf(from);
  return lengthOn(loop, from, place) / lengthOn(loop, from, to);
}

bool BorderCurves::isNear(double from, double to, const Vector3f& start, const Vector3f& end, float distance) const
{
  const Loop loop = loopOf(from);
  const double length = lengthOn(loop, from, to);
  std::size_t node = nodeBefore(from);
  for (std::size_t n = loop.first; n < loop.last; ++n) {
    node = node + 1 < loop.last ? node + 1 : loop.first; // the last node repeats the first one
    if (lengthOn(loop, from, starts_[node]) >= length)
      break;
    if (!(squaredDistance(nodes_[node], start, end) <= distance * distance))
      return false;
  }
  return true;
}

} // namespace pcl::mrf
