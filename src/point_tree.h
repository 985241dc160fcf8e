/// \file
/// \brief Sorted points and a tree of bounding boxes over them.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace pcl {
namespace mrf {

struct IndexedPoint {
  float x, y, z;
  std::uint32_t index;

  /// In this order of operations everywhere, so that all ways to an answer agree on it to the last bit.
  float squaredDistanceTo(const Eigen::Vector3f& query) const
  {
    const float dx = query.x() - x, dy = query.y() - y, dz = query.z() - z;
    return dx * dx + dy * dy + dz * dz;
  }
};

/// The k nearest of the points it is shown, nearest first, equals by index.
class Nearest {
public:
  /// \param distances, indices room for k values each
  Nearest(std::size_t k, float* distances, std::uint32_t* indices) : k_(k), distances_(distances), indices_(indices) {}

  /// Whether a point at this distance may still be one of them.
  bool admits(float distance, std::uint32_t index) const
  {
    if (count_ < k_)
      return true;
    const float worst = distances_[k_ - 1];
    return distance < worst || (distance == worst && index < indices_[k_ - 1]);
  }

  void add(float distance, std::uint32_t index)
  {
    if (!admits(distance, index))
      return;
    std::size_t n = count_ < k_ ? count_++ : k_ - 1;
    for (; n > 0 && (distances_[n - 1] > distance || (distances_[n - 1] == distance && indices_[n - 1] > index)); --n) {
      distances_[n] = distances_[n - 1];
      indices_[n] = indices_[n - 1];
    }
    distances_[n] = distance;
    indices_[n] = index;
  }

  void clear() { count_ = 0; }
  std::size_t size() const { return count_; }
  std::size_t capacity() const { return k_; }

  /// Squared distance to the k-th, infinite until there are so many.
  float worst() const { return count_ < k_ ? std::numeric_limits<float>::infinity() : distances_[k_ - 1]; }

private:
  std::size_t k_, count_ = 0;
  float* distances_;
  std::uint32_t* indices_;
};

/// Finds neighbours however the points are distributed; it is the faster, the closer in memory points are that are
/// close in space. Boxes over runs of points, four to a parent: no pointers, about 2.5 bytes per point.
class PointTree {
public:
  /// \param points stay the caller's and must not change
  void build(const std::vector<IndexedPoint>& points, Execution& execution);

  void findNearest(const Eigen::Vector3f& query, Nearest& nearest) const;

  /// Calls found(squaredDistance, index) for all points with a smaller squared distance than `limit`.
  template <typename Found>
  void findWithin(const Eigen::Vector3f& query, float limit, const Found& found) const;

private:
  static constexpr std::size_t leafSize = 16, fanOut = 4;
  /// Each of the at most 16 levels leaves at most fanOut − 1 siblings behind.
  static constexpr std::size_t stackSize = 16 * fanOut;

  struct Box {
    Eigen::Array3f lower, upper;
    std::uint32_t smallestIndex;

    /// Not larger than the distance to any point in it, as squaredDistanceTo rounds it: rounding is monotonic.
    float squaredDistanceTo(const Eigen::Vector3f& query) const
    {
      const Eigen::Array3f gap = (lower - query.array()).max(query.array() - upper).max(0);
      return gap.x() * gap.x() + gap.y() * gap.y() + gap.z() * gap.z();
    }
  };

  /// A node to be visited.
  struct Visit {
    float distance;
    std::uint32_t level, node;
  };

  const std::vector<IndexedPoint>* points_ = nullptr;
  std::vector<std::vector<Box>> levels_; ///< leaves first
};

template <typename Found>
void PointTree::findWithin(const Eigen::Vector3f& query, float limit, const Found& found) const
{
  if (levels_.empty())
    return;
  std::array<Visit, stackSize> stack;
  std::size_t depth = 0;
  stack[depth++] = {0, static_cast<std::uint32_t>(levels_.size() - 1), 0};
  while (depth > 0) {
    const Visit visit = stack[--depth];
    if (visit.level == 0) {
      const std::size_t begin = visit.node * leafSize, end = std::min(begin + leafSize, points_->size());
      for (std::size_t n = begin; n < end; ++n) {
        const float distance = (*points_)[n].squaredDistanceTo(query);
        if (distance < limit)
          found(distance, (*points_)[n].index);
      }
      continue;
    }
    const std::vector<Box>& boxes = levels_[visit.level - 1];
    const std::size_t first = visit.node * fanOut, last = std::min(first + fanOut, boxes.size());
    for (std::size_t child = first; child < last; ++child)
      if (boxes[child].squaredDistanceTo(query) < limit)
        stack[depth++] = {0, visit.level - 1, static_cast<std::uint32_t>(child)};
  }
}

} // namespace mrf
} // namespace pcl
