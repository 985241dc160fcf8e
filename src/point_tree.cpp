#include "point_tree.h"

#include <algorithm>

namespace pcl {
namespace mrf {
namespace {

/// Boxes per piece of parallel work.
constexpr std::int64_t grain = 4096;

} // namespace

void PointTree::build(const std::vector<IndexedPoint>& points, Execution& execution)
{
  points_ = &points;
  levels_.clear();
  if (points.empty())
    return;
  std::vector<Box> boxes((points.size() + leafSize - 1) / leafSize);
  execution.forRange(static_cast<std::int64_t>(boxes.size()), grain, [&](std::int64_t begin, std::int64_t end) {
    for (auto b = static_cast<std::size_t>(begin); b < static_cast<std::size_t>(end); ++b) {
      const std::size_t first = b * leafSize, last = std::min(first + leafSize, points.size());
      Box& box = boxes[b];
      box.lower = box.upper = Eigen::Array3f(points[first].x, points[first].y, points[first].z);
      box.smallestIndex = points[first].index;
      for (std::size_t n = first + 1; n < last; ++n) {
        const Eigen::Array3f position(points[n].x, points[n].y, points[n].z);
        box.lower = box.lower.min(position);
        box.upper = box.upper.max(position);
        box.smallestIndex = std::min(box.smallestIndex, points[n].index);
      }
    }
  });
  levels_.push_back(std::move(boxes));
  while (levels_.back().size() > 1) {
    const std::vector<Box>& children = levels_.back();
    std::vector<Box> parents((children.size() + fanOut - 1) / fanOut);
    execution.forRange(static_cast<std::int64_t>(parents.size()), grain, [&](std::int64_t begin, std::int64_t end) {
      for (auto b = static_cast<std::size_t>(begin); b < static_cast<std::size_t>(end); ++b) {
        Box& box = parents[b];
        box = children[b * fanOut];
        for (std::size_t c = b * fanOut + 1; c < std::min((b + 1) * fanOut, children.size()); ++c) {
          box.lower = box.lower.min(children[c].lower);
          box.upper = box.upper.max(children[c].upper);
          box.smallestIndex = std::min(box.smallestIndex, children[c].smallestIndex);
        }
      }
    });
    levels_.push_back(std::move(parents));
  }
}

void PointTree::findNearest(const Eigen::Vector3f& query, Nearest& nearest) const
{
  if (levels_.empty())
    return;
  std::array<Visit, stackSize> stack;
  std::size_t depth = 0;
  stack[depth++] = {levels_.back()[0].squaredDistanceTo(query), static_cast<std::uint32_t>(levels_.size() - 1), 0};
  while (depth > 0) {
    const Visit visit = stack[--depth];
    if (!nearest.admits(visit.distance, levels_[visit.level][visit.node].smallestIndex))
      continue;
    if (visit.level == 0) {
      const std::size_t begin = visit.node * leafSize, end = std::min(begin + leafSize, points_->size());
      for (std::size_t n = begin; n < end; ++n)
        nearest.add((*points_)[n].squaredDistanceTo(query), (*points_)[n].index);
      continue;
    }
    const std::vector<Box>& boxes = levels_[visit.level - 1];
    const std::size_t first = visit.node * fanOut, last = std::min(first + fanOut, boxes.size());
    const std::size_t base = depth;
    for (std::size_t child = first; child < last; ++child) {
      const float distance = boxes[child].squaredDistanceTo(query);
      if (!nearest.admits(distance, boxes[child].smallestIndex))
        continue;
      // The nearest on top; of equals, the one with the smallest index.
      std::size_t n = depth++;
      const auto isNearer = [&](const Visit& other) {
        return other.distance < distance ||
               (other.distance == distance && boxes[other.node].smallestIndex < boxes[child].smallestIndex);
      };
      for (; n > base && isNearer(stack[n - 1]); --n)
        stack[n] = stack[n - 1];
      stack[n] = {distance, visit.level - 1, static_cast<std::uint32_t>(child)};
    }
  }
}

} // namespace mrf
} // namespace pcl
