// SPDX-License-Identifier: BSD-3-Clause
#include "points/point_tree.h"

#include <Eigen/Geometry>

namespace pcl {
namespace mrf {
namespace {

/// Nodes per piece of parallel work.
constexpr std::int64_t treeGrain = 1024;

constexpr float infinite = std::numeric_limits<float>::infinity();

} // namespace

PointTree::Node::Node()
{
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t c = 0; c < fanOut; ++c) {
      lower[axis][c] = infinite;
      upper[axis][c] = -infinite;
    }
  std::fill(std::begin(smallestIndex), std::end(smallestIndex), std::numeric_limits<std::uint32_t>::max());
}

void PointTree::arrange(std::vector<IndexedPoint>& points, std::size_t begin, std::size_t end)
{
  // The place inside that divides the highest nodes.
  std::size_t step = leafSize, middle = (begin / leafSize + 1) * leafSize;
  if (middle >= end)
    return;
  while ((begin / (2 * step) + 1) * (2 * step) < end) {
    step *= 2;
    middle = (begin / step + 1) * step;
  }
  Eigen::AlignedBox3f box;
  for (std::size_t n = begin; n < end; ++n)
    box.extend(Eigen::Vector3f(points[n].x, points[n].y, points[n].z));
  Eigen::Index widest = 0;
  box.sizes().maxCoeff(&widest);
  const auto coordinate = widest == 0 ? &IndexedPoint::x : widest == 1 ? &IndexedPoint::y : &IndexedPoint::z;
  const auto at = [&](std::size_t n) { return points.begin() + static_cast<std::ptrdiff_t>(n); };
  std::nth_element(at(begin), at(middle), at(end), [&](const IndexedPoint& p, const IndexedPoint& q) {
    return p.*coordinate != q.*coordinate ? p.*coordinate < q.*coordinate : p.index < q.index;
  });
  arrange(points, begin, middle);
  arrange(points, middle, end);
}

void PointTree::build(const std::vector<IndexedPoint>& points, Execution& execution)
{
  points_ = &points;
  levels_.clear();
  if (points.empty())
    return;
  const auto parentsOf = [](std::size_t children) { return (children + fanOut - 1) / fanOut; };
  const std::size_t leaves = (points.size() + leafSize - 1) / leafSize;
  std::vector<Node> nodes(parentsOf(leaves));
  execution.forRange(static_cast<std::int64_t>(nodes.size()), treeGrain, [&](std::int64_t begin, std::int64_t end) {
    for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n)
      for (std::size_t c = 0; c < fanOut && n * fanOut + c < leaves; ++c)
        for (std::size_t p = pointsBegin(n * fanOut + c); p < pointsEnd(n * fanOut + c); ++p) {
          const float position[] = {points[p].x, points[p].y, points[p].z};
          for (int axis = 0; axis < 3; ++axis) {
            nodes[n].lower[axis][c] = std::min(nodes[n].lower[axis][c], position[axis]);
            nodes[n].upper[axis][c] = std::max(nodes[n].upper[axis][c], position[axis]);
          }
          nodes[n].smallestIndex[c] = std::min(nodes[n].smallestIndex[c], points[p].index);
        }
  });
  levels_.push_back(std::move(nodes));
  while (levels_.back().size() > 1) {
    const std::vector<Node>& children = levels_.back();
    std::vector<Node> parents(parentsOf(children.size()));
    execution.forRange(static_cast<std::int64_t>(parents.size()), treeGrain, [&](std::int64_t begin, std::int64_t end) {
      for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n)
        for (std::size_t c = 0; c < fanOut && n * fanOut + c < children.size(); ++c) {
          const Node& child = children[n * fanOut + c];
          for (int axis = 0; axis < 3; ++axis) {
            parents[n].lower[axis][c] = *std::min_element(std::begin(child.lower[axis]), std::end(child.lower[axis]));
            parents[n].upper[axis][c] = *std::max_element(std::begin(child.upper[axis]), std::end(child.upper[axis]));
          }
          parents[n].smallestIndex[c] =
              *std::min_element(std::begin(child.smallestIndex), std::end(child.smallestIndex));
        }
    });
    levels_.push_back(std::move(parents));
  }
}

float PointTree::boundFromMemory(std::size_t n, std::size_t k) const
{
  constexpr std::size_t reach = 16;
  const std::size_t begin = n > reach ? n - reach : 0, end = std::min(n + reach, points_->size());
  if (end - begin < k || k == 0)
    return infinite;
  const Eigen::Vector3f query((*points_)[n].x, (*points_)[n].y, (*points_)[n].z);
  std::array<float, 2 * reach> distances;
  for (std::size_t p = begin; p < end; ++p)
    distances[p - begin] = (*points_)[p].squaredDistanceTo(query);
  const auto kth = distances.begin() + static_cast<std::ptrdiff_t>(k - 1);
  std::nth_element(distances.begin(), kth, distances.begin() + static_cast<std::ptrdiff_t>(end - begin));
  return *kth;
}

template <typename Admits, typename VisitLeaf>
void PointTree::descend(const Eigen::Vector3f& query, const Admits& admits, const VisitLeaf& visitLeaf) const
{
  if (levels_.empty())
    return;
  Visits visits(levels_.size());
  auto& [stack, depth] = visits;
  while (depth > 0) {
    const Visit visit = stack[--depth];
    if (!admits(visit.distance, visit.smallestIndex))
      continue;
    if (visit.level == 0) {
      visitLeaf(pointsBegin(visit.number), pointsEnd(visit.number));
      continue;
    }
    const Node& node = levels_[visit.level - 1][visit.number];
    float distances[fanOut];
    node.squaredDistancesTo(query, distances);
    const std::size_t base = depth;
    for (std::size_t c = 0; c < fanOut; ++c) {
      // Also of a missing child, which is infinitely far, unless the distances of the others overflow as well.
      if (node.smallestIndex[c] == std::numeric_limits<std::uint32_t>::max() ||
          !admits(distances[c], node.smallestIndex[c]))
        continue;
      // The nearest on top; of equals, the one with the smallest index.
      std::size_t n = depth++;
      const auto isNearer = [&](const Visit& other) {
        return other.distance < distances[c] ||
               (other.distance == distances[c] && other.smallestIndex < node.smallestIndex[c]);
      };
      for (; n > base && isNearer(stack[n - 1]); --n)
        stack[n] = stack[n - 1];
      stack[n] = {distances[c], node.smallestIndex[c], visit.level - 1,
                  static_cast<std::uint32_t>(visit.number * fanOut + c)};
    }
  }
}

void PointTree::findNearest(const Eigen::Vector3f& query, Nearest& nearest, float bound) const
{
  descend(
      query, [&](float distance, std::uint32_t index) { return distance <= bound && nearest.admits(distance, index); },
      [&](std::size_t begin, std::size_t end) {
        float distances[leafSize];
        for (std::size_t n = begin; n < end; ++n)
          distances[n - begin] = (*points_)[n].squaredDistanceTo(query);
        for (std::size_t n = begin; n < end; ++n)
          if (distances[n - begin] <= bound)
            nearest.add(distances[n - begin], (*points_)[n].index);
      });
}

std::uint64_t PointTree::findClosest(const Eigen::Vector3f& query, std::uint64_t known) const
{
  descend(
      query, [&](float distance, std::uint32_t index) { return ranked(distance, index) < known; },
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n)
          known = std::min(known, ranked((*points_)[n].squaredDistanceTo(query), (*points_)[n].index));
      });
  return known;
}

} // namespace mrf
} // namespace pcl
