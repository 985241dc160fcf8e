// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Sorted points and a tree of bounding boxes over them.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

namespace pcl {
namespace mrf {

struct IndexedPoint {
  float x, y, z;
  std::uint32_t index;

  IndexedPoint() {} // not set: clearing millions first takes time
  IndexedPoint(float ofX, float ofY, float ofZ, std::uint32_t number) : x(ofX), y(ofY), z(ofZ), index(number) {}

  /// In this order of operations everywhere, so that all ways to an answer agree on it to the last bit.
  float squaredDistanceTo(const Eigen::Vector3f& query) const
  {
    const float dx = query.x() - x, dy = query.y() - y, dz = query.z() - z;
    return dx * dx + dy * dy + dz * dz;
  }
};

/// Distance and index in one number, of which the smallest takes no branch to find: distances are not negative, so that
/// their bits are ordered as they are, equals by index.
inline std::uint64_t ranked(float distance, std::uint32_t index)
{
  std::uint32_t bits = 0;
  std::memcpy(&bits, &distance, sizeof bits);
  return std::uint64_t{bits} << 32 | index;
}

inline float distanceOf(std::uint64_t entry)
{
  const auto bits = static_cast<std::uint32_t>(entry >> 32);
  float distance = 0;
  std::memcpy(&distance, &bits, sizeof distance);
  return distance;
}

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

/// Finds neighbors however the points are distributed; it is the faster, the closer in memory points are that are
/// close in space. Boxes over runs of points, four to a parent: no pointers, about 2.5 bytes per point.
class PointTree {
public:
  /// Reorders points begin..end−1 so that the boxes over them are small, whatever their distribution: split at medians
  /// where the tree splits. Equals by index. Cost: n log n.
  static void arrange(std::vector<IndexedPoint>& points, std::size_t begin, std::size_t end);

  /// \param points stay the caller's and must not change
  void build(const std::vector<IndexedPoint>& points, Execution& execution);

  /// \param bound a squared distance that the farthest of them is known not to exceed: spares looking farther
  void findNearest(const Eigen::Vector3f& query, Nearest& nearest,
                   float bound = std::numeric_limits<float>::infinity()) const;

  /// The nearest one, ranked, or what is known already if that is nearer.
  std::uint64_t findClosest(const Eigen::Vector3f& query,
                            std::uint64_t known = std::numeric_limits<std::uint64_t>::max()) const;

  /// Such a bound for the k nearest of the n-th point: that of the k nearest of its neighbors in memory.
  float boundFromMemory(std::size_t n, std::size_t k) const;

  /// Calls found(squaredDistance, index) for all points with a smaller squared distance than `limit`.
  template <typename Found>
  void findWithin(const Eigen::Vector3f& query, float limit, const Found& found) const;

private:
  static constexpr std::size_t leafSize = 16, fanOut = 4;
  /// Each of the at most 16 levels leaves at most fanOut − 1 siblings behind.
  static constexpr std::size_t stackSize = 16 * fanOut;

  /// The boxes of four children, side by side for the sake of vectors; those that are missing are infinitely far.
  struct Node {
    float lower[3][fanOut], upper[3][fanOut];
    std::uint32_t smallestIndex[fanOut];

    Node();

    /// Not larger than the distances to any points in them, as squaredDistanceTo rounds those: rounding is monotonic.
    void squaredDistancesTo(const Eigen::Vector3f& query, float (&result)[fanOut]) const
    {
      for (std::size_t c = 0; c < fanOut; ++c) {
        const float dx = gap(query.x(), lower[0][c], upper[0][c]), dy = gap(query.y(), lower[1][c], upper[1][c]),
                    dz = gap(query.z(), lower[2][c], upper[2][c]);
        result[c] = dx * dx + dy * dy + dz * dz;
      }
    }

    static float gap(float value, float lowest, float highest)
    {
      return std::max(std::max(lowest - value, value - highest), 0.f);
    }
  };

  /// A leaf or a node to be visited.
  struct Visit {
    float distance;
    std::uint32_t smallestIndex;
    std::uint32_t level; ///< 0 = leaf
    std::uint32_t number;
  };

  /// What is still to be visited: at first the root. \pre the tree is not empty
  struct Visits {
    std::array<Visit, stackSize> stack;
    std::size_t depth = 1;

    explicit Visits(std::size_t levels) { stack[0] = {0, 0, static_cast<std::uint32_t>(levels), 0}; }
  };

  /// Calls visitLeaf(begin, end) for the points of leaves that may hold what is looked for, the nearest leaf first.
  /// \param admits whether something this far away, of this smallest index, may still be it
  template <typename Admits, typename VisitLeaf>
  void descend(const Eigen::Vector3f& query, const Admits& admits, const VisitLeaf& visitLeaf) const;

  std::size_t pointsBegin(std::size_t leaf) const { return leaf * leafSize; }
  std::size_t pointsEnd(std::size_t leaf) const { return std::min((leaf + 1) * leafSize, points_->size()); }

  const std::vector<IndexedPoint>* points_ = nullptr;
  std::vector<std::vector<Node>> levels_; ///< the parents of the leaves first
};

template <typename Found>
void PointTree::findWithin(const Eigen::Vector3f& query, float limit, const Found& found) const
{
  if (levels_.empty())
    return;
  Visits visits(levels_.size());
  auto& [stack, depth] = visits;
  while (depth > 0) {
    const Visit visit = stack[--depth];
    if (visit.level == 0) {
      for (std::size_t n = pointsBegin(visit.number); n < pointsEnd(visit.number); ++n) {
        const float distance = (*points_)[n].squaredDistanceTo(query);
        if (distance < limit)
          found(distance, (*points_)[n].index);
      }
      continue;
    }
    float distances[fanOut];
    levels_[visit.level - 1][visit.number].squaredDistancesTo(query, distances);
    for (std::size_t c = 0; c < fanOut; ++c)
      if (distances[c] < limit)
        stack[depth++] = {0, 0, visit.level - 1, static_cast<std::uint32_t>(visit.number * fanOut + c)};
  }
}

} // namespace mrf
} // namespace pcl
