// SPDX-License-Identifier: BSD-3-Clause
/// Neighbor search by a tree of boxes over points that are sorted in space.
#pragma once

#include <pcl/surface/mrf/neighbor_search.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

namespace pcl::mrf {

/// Keeps the k smallest of the ranks that are added, ascending. A rank holds a squared distance and an index in one
/// number, so that comparing takes no branch: distances are not negative, so that their bits are ordered as they are.
class Nearest {
public:
  static constexpr std::uint64_t none = std::numeric_limits<std::uint64_t>::max();

  /// \param ranks room for k of them, k > 0
  Nearest(std::size_t k, std::uint64_t* ranks) : k_(k), ranks_(ranks) {}

  std::size_t size() const { return size_; }

  /// Only ranks below this one are kept.
  std::uint64_t end() const { return size_ < k_ ? none : ranks_[k_ - 1]; }

  void add(std::uint64_t rank)
  {
    if (rank >= end())
      return;
    std::size_t n = size_ < k_ ? size_++ : k_ - 1;
    for (; n > 0 && ranks_[n - 1] > rank; --n)
      ranks_[n] = ranks_[n - 1];
    ranks_[n] = rank;
  }

private:
  std::size_t k_, size_ = 0;
  std::uint64_t* ranks_;
};

/// The same for a large k, where keeping the ranks sorted would take longer than finding them.
class NearestOfMany {
public:
  /// \param k > 0
  explicit NearestOfMany(std::size_t k) : k_(k) { ranks_.reserve(2 * k); }

  std::uint64_t end() const { return end_; }

  void add(std::uint64_t rank)
  {
    if (rank >= end_)
      return;
    ranks_.push_back(rank);
    if (ranks_.size() == 2 * k_)
      dropFarther();
  }

  /// The k smallest ranks, or all if there are fewer, ascending.
  std::vector<std::uint64_t> sorted() &&
  {
    if (ranks_.size() > k_)
      dropFarther();
    std::sort(ranks_.begin(), ranks_.end());
    return std::move(ranks_);
  }

private:
  void dropFarther()
  {
    const auto last = ranks_.begin() + static_cast<std::ptrdiff_t>(k_ - 1);
    std::nth_element(ranks_.begin(), last, ranks_.end());
    end_ = *last;
    ranks_.resize(k_);
  }

  std::size_t k_;
  std::uint64_t end_ = Nearest::none;
  std::vector<std::uint64_t> ranks_;
};

/// A tree with sixteen points per leaf and four children per node, split at medians of the widest axis. Children are
/// found by counting, and the boxes of a million points take 2.4 MB. Any distribution of points costs about the same.
///
/// Answers are exact; of equal distances those with the smaller indices are taken. Rounding does not change that: it is
/// monotonic, and all distances are computed in one order of operations, so that a box is never farther from a query
/// than the points in it.
class PointIndex final : public NeighborSearch {
public:
  PointIndex();
  ~PointIndex() override;
  void setPoints(const std::vector<Eigen::Vector3f>& positions) override;
  void setPoints(const std::vector<Eigen::Vector3f>& positions, Execution& execution) override;
  void dropPoints(const std::vector<Eigen::Vector3f>& left, const std::vector<std::uint8_t>& keep,
                  Execution& execution) override;
  void rest() override;
  void wake(const std::vector<Eigen::Vector3f>& positions, Execution& execution) override;

  int nearest(const Eigen::Vector3f& query, int k, Neighbors& result) const override;
  int within(const Eigen::Vector3f& query, float radius, Neighbors& result) const override;

  /// Answers the points of a leaf together: the points close to the leaf are gathered once and compared with all of it.
  void forEachPosition(const std::vector<Eigen::Vector3f>& positions, int k, Answer answer, Execution& execution,
                       const std::function<void(const NeighborBatch&)>& visit) const override;

private:
  using Box = Eigen::AlignedBox3f;
  using Four = Eigen::Array4f;
  static constexpr std::size_t leafSize = 16, fanOut = 4;

  struct Leaf;
  struct Node;
  struct Group;

  void clear();

  template <typename Admits, typename Visit>
  void descend(const Box& query, const Admits& admits, const Visit& visit) const;
  template <typename Found>
  void findNearest(const Eigen::Vector3f& query, Found& nearest) const;

  bool gather(const Box& around, float bound, Group& group) const;
  void answerOne(const Eigen::Vector3f& query, std::size_t k, float* distances, std::uint32_t* indices) const;
  void answerLeaf(std::size_t leaf, std::size_t k, Answer answer, Group& group,
                  const std::function<void(const NeighborBatch&)>& visit) const;

  std::size_t size_ = 0; ///< number of points
  std::vector<Leaf> leaves_;
  std::vector<std::vector<Node>> levels_; ///< the parents of the leaves first
  std::vector<std::uint32_t> order_;      ///< of the points in the leaves; only kept while there are no leaves
};

} // namespace pcl::mrf
