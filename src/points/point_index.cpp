// SPDX-License-Identifier: BSD-3-Clause
#include "points/nearest_kernels.h"

#include <pcl/surface/mrf/neighbor_search.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace pcl::mrf {
namespace {

/// A point and its index in the input.
struct IndexedPoint {
  Eigen::Vector3f position;
  std::uint32_t index;
};

constexpr std::size_t leafSize = 16, fanOut = 4;

constexpr float infinite = std::numeric_limits<float>::infinity();
constexpr std::uint32_t noIndex = std::numeric_limits<std::uint32_t>::max();

/// Leaves, and points, per piece of parallel work.
constexpr std::int64_t leafGrain = 256;
constexpr std::ptrdiff_t pointGrain = 1 << 14;

/// Max number of points gathered around a leaf. If there are more, each point of the leaf is answered alone.
constexpr std::size_t maxCandidates = 768;

/// Max number of points as near as the k-th nearest. If equal distances make it more, the query is answered alone.
constexpr std::size_t maxHits = 32;

std::uint64_t rankOf(float distance, std::uint32_t index)
{
  std::uint32_t bits = 0;
  std::memcpy(&bits, &distance, sizeof bits);
  return std::uint64_t{bits} << 32 | index;
}

float distanceOf(std::uint64_t rank)
{
  const auto bits = static_cast<std::uint32_t>(rank >> 32);
  float distance = 0;
  std::memcpy(&distance, &bits, sizeof distance);
  return distance;
}

std::uint32_t indexOf(std::uint64_t rank)
{
  return static_cast<std::uint32_t>(rank);
}

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

/// Number of points in the lower half of a split: the largest leafSize · 2ⁿ below count, so that leaves are full.
std::ptrdiff_t placeOfSplit(std::ptrdiff_t count)
{
  std::ptrdiff_t half = leafSize;
  while (2 * half < count)
    half *= 2;
  return half;
}

using Points = std::vector<IndexedPoint>::iterator;

/// Divides points along their widest axis. \return where the upper half begins; the end if they fit a leaf
Points split(Points begin, Points end)
{
  if (end - begin <= std::ptrdiff_t{leafSize})
    return end;
  Eigen::AlignedBox3f box;
  for (auto point = begin; point != end; ++point)
    box.extend(point->position);
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const auto middle = begin + placeOfSplit(end - begin);
  std::nth_element(begin, middle, end, [axis](const IndexedPoint& p, const IndexedPoint& q) {
    return p.position[axis] != q.position[axis] ? p.position[axis] < q.position[axis] : p.index < q.index;
  });
  return middle;
}

void arrange(Points begin, Points end)
{
  const auto middle = split(begin, end);
  if (middle != end) {
    arrange(begin, middle);
    arrange(middle, end);
  }
}

/// Points, one array per coordinate for vector instructions. Missing points are infinitely far away.
struct Leaf {
  std::array<float, leafSize> x, y, z;
  std::array<std::uint32_t, leafSize> index;

  Leaf()
  {
    x.fill(infinite);
    y.fill(infinite);
    z.fill(infinite);
    index.fill(noIndex);
  }

  Eigen::Vector3f position(std::size_t n) const { return {x[n], y[n], z[n]}; }

  std::size_t size() const
  {
    return static_cast<std::size_t>(std::find(index.begin(), index.end(), noIndex) - index.begin());
  }

  /// The order of operations is the same everywhere, so that all ways to compute a distance agree to the last bit.
  void squaredDistances(const Eigen::Vector3f& query, float (&result)[leafSize]) const
  {
    for (std::size_t n = 0; n < leafSize; ++n) {
      const float dx = query.x() - x[n], dy = query.y() - y[n], dz = query.z() - z[n];
      result[n] = dx * dx + dy * dy + dz * dz;
    }
  }
};

/// The boxes of four children, one array per coordinate.
struct Node {
  Eigen::Array4f lower[3], upper[3];
  std::uint32_t smallestIndex[fanOut];

  Node()
  {
    std::fill_n(lower, 3, Eigen::Array4f::Constant(infinite));
    std::fill_n(upper, 3, Eigen::Array4f::Constant(-infinite));
    std::fill_n(smallestIndex, fanOut, noIndex);
  }

  void set(std::size_t child, const Eigen::AlignedBox3f& box, std::uint32_t index)
  {
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis][child] = box.min()[axis];
      upper[axis][child] = box.max()[axis];
    }
    smallestIndex[child] = index;
  }

  Eigen::AlignedBox3f box() const
  {
    return {Eigen::Vector3f(lower[0].minCoeff(), lower[1].minCoeff(), lower[2].minCoeff()),
            Eigen::Vector3f(upper[0].maxCoeff(), upper[1].maxCoeff(), upper[2].maxCoeff())};
  }

  Eigen::Array4f squaredDistances(const Eigen::AlignedBox3f& query) const
  {
    const auto distance = [&](int axis) -> Eigen::Array4f {
      return (lower[axis] - query.max()[axis]).max(query.min()[axis] - upper[axis]).max(0);
    };
    const Eigen::Array4f dx = distance(0), dy = distance(1), dz = distance(2);
    return dx * dx + dy * dy + dz * dz;
  }
};

/// The points around a leaf.
struct Group {
  std::size_t size = 0;
  std::array<float, maxCandidates> x, y, z;
  std::array<std::uint32_t, maxCandidates> indices;

  void add(const Leaf& leaf)
  {
    std::copy(leaf.x.begin(), leaf.x.end(), x.begin() + size);
    std::copy(leaf.y.begin(), leaf.y.end(), y.begin() + size);
    std::copy(leaf.z.begin(), leaf.z.end(), z.begin() + size);
    std::copy(leaf.index.begin(), leaf.index.end(), indices.begin() + size);
    size += leafSize;
  }

  kernels::Coordinates coordinates() const { return {x.data(), y.data(), z.data()}; }

  /// The squared distances of queries to their k nearest, by rank and query.
  void nearest(const Leaf& queries, std::size_t k, float* sorted) const
  {
    kernels::nearestDistances(size, coordinates(), {queries.x.data(), queries.y.data(), queries.z.data()}, k, sorted);
  }

  /// Finds points within a squared distance, without an unpredictable branch. \param ranks receives at most maxHits
  /// \return their number, which may be larger
  std::size_t ranksWithin(const Eigen::Vector3f& query, float limit, std::uint64_t* ranks)
  {
    kernels::distances(size, coordinates(), query.data(), distances_.data());
    std::size_t hits = 0;
    for (std::size_t c = 0; c < size; ++c) {
      hits_[hits] = static_cast<std::uint32_t>(c);
      hits += distances_[c] <= limit ? 1 : 0;
    }
    for (std::size_t h = 0; h < std::min(hits, maxHits); ++h)
      ranks[h] = rankOf(distances_[hits_[h]], indices[hits_[h]]);
    return hits;
  }

private:
  std::array<float, maxCandidates> distances_;
  std::array<std::uint32_t, maxCandidates> hits_;
};

/// A tree with sixteen points per leaf and four children per node, split at medians of the widest axis. Children are
/// found by counting, and the boxes of a million points take 2.4 MB. Any distribution of points costs about the same.
///
/// Answers are exact; of equal distances those with the smaller indices are taken. Rounding does not change that: it is
/// monotonic, and all distances are computed in one order of operations, so that a box is never farther from a query
/// than the points in it.
class PointIndex final : public NeighborSearch {
public:
  void setPoints(const std::vector<Eigen::Vector3f>& positions) override
  {
    Execution serial(1);
    setPoints(positions, serial);
  }

  void setPoints(const std::vector<Eigen::Vector3f>& positions, Execution& execution) override
  {
    clear();
    order_.clear();
    {
      std::vector<IndexedPoint> points(positions.size());
      for (std::uint32_t i = 0; i < positions.size(); ++i)
        points[i] = {positions[i], i};
      // Halves, quarters, ... until they are small enough for one piece of work.
      std::vector<std::pair<Points, Points>> parts{{points.begin(), points.end()}};
      while (parts.front().second - parts.front().first > pointGrain) {
        std::vector<std::pair<Points, Points>> halves(2 * parts.size());
        execution.forRange(parts.size(), 1, [&](std::size_t n, std::size_t) {
          const auto [begin, end] = parts[n];
          const auto middle = split(begin, end);
          halves[2 * n] = {begin, middle};
          halves[2 * n + 1] = {middle, end};
        });
        parts.swap(halves);
      }
      execution.forRange(parts.size(), 1,
                         [&](std::size_t n, std::size_t) { arrange(parts[n].first, parts[n].second); });
      order_.reserve(points.size());
      for (const IndexedPoint& point : points)
        order_.push_back(point.index);
    }
    wake(positions, execution);
  }

  void dropPoints(const std::vector<Eigen::Vector3f>& left, const std::vector<std::uint8_t>& keep,
                  Execution& execution) override
  {
    // If more than one point in `few` is dropped, the leaves do not suit the rest.
    constexpr std::size_t few = 8;
    if ((keep.size() - left.size()) * few > keep.size()) {
      setPoints(left, execution);
      return;
    }
    rest();
    std::vector<std::uint32_t> numbers(keep.size());
    std::uint32_t next = 0;
    for (std::size_t i = 0; i < keep.size(); ++i)
      numbers[i] = keep[i] ? next++ : noIndex;
    for (std::uint32_t& index : order_)
      index = numbers[index];
    order_.erase(std::remove(order_.begin(), order_.end(), noIndex), order_.end());
    wake(left, execution);
  }

  void rest() override
  {
    if (leaves_.empty())
      return;
    order_.reserve(size_);
    for (const Leaf& leaf : leaves_)
      order_.insert(order_.end(), leaf.index.begin(), leaf.index.begin() + leaf.size());
    clear();
  }

  void wake(const std::vector<Eigen::Vector3f>& positions, Execution& execution) override
  {
    if (order_.empty())
      return;
    size_ = order_.size();
    leaves_ = std::vector<Leaf>((size_ + leafSize - 1) / leafSize);
    const auto parentsOf = [](std::size_t children) { return (children + fanOut - 1) / fanOut; };
    std::vector<Node> nodes(parentsOf(leaves_.size()));
    execution.forRange(nodes.size(), leafGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t leaf = begin * fanOut; leaf < std::min(end * fanOut, leaves_.size()); ++leaf) {
        Leaf& own = leaves_[leaf];
        Eigen::AlignedBox3f box;
        for (std::size_t p = leaf * leafSize; p < std::min((leaf + 1) * leafSize, size_); ++p) {
          const std::size_t n = p % leafSize;
          const Eigen::Vector3f& position = positions[order_[p]];
          own.x[n] = position.x();
          own.y[n] = position.y();
          own.z[n] = position.z();
          own.index[n] = order_[p];
          box.extend(position);
        }
        nodes[leaf / fanOut].set(leaf % fanOut, box, *std::min_element(own.index.begin(), own.index.end()));
      }
    });
    order_ = std::vector<std::uint32_t>();
    while (nodes.size() > 1) {
      std::vector<Node> parents(parentsOf(nodes.size()));
      for (std::size_t n = 0; n < nodes.size(); ++n)
        parents[n / fanOut].set(n % fanOut, nodes[n].box(),
                                *std::min_element(nodes[n].smallestIndex, nodes[n].smallestIndex + fanOut));
      levels_.push_back(std::move(nodes));
      nodes = std::move(parents);
    }
    levels_.push_back(std::move(nodes));
  }

  int nearest(const Eigen::Vector3f& query, int k, Neighbors& result) const override
  {
    const std::size_t wanted = query.allFinite() ? std::min<std::size_t>(std::max(k, 0), size_) : 0;
    result.indices.resize(wanted);
    result.squaredDistances.resize(wanted);
    if (wanted == 0)
      return 0;
    constexpr std::size_t few = 64;
    std::array<std::uint64_t, few> room;
    std::vector<std::uint64_t> more;
    if (wanted > few) {
      NearestOfMany nearest(wanted);
      findNearest(query, nearest);
      more = std::move(nearest).sorted();
    } else {
      Nearest nearest(wanted, room.data());
      findNearest(query, nearest);
    }
    const std::uint64_t* const ranks = wanted > few ? more.data() : room.data();
    for (std::size_t n = 0; n < wanted; ++n) {
      result.indices[n] = static_cast<int>(indexOf(ranks[n]));
      result.squaredDistances[n] = distanceOf(ranks[n]);
    }
    return static_cast<int>(wanted);
  }

  int within(const Eigen::Vector3f& query, float radius, Neighbors& result) const override
  {
    result.indices.clear();
    result.squaredDistances.clear();
    if (!query.allFinite() || !(radius > 0))
      return 0;
    const auto limit = static_cast<float>(double{radius} * radius);
    std::vector<std::uint64_t> found;
    descend(
        Eigen::AlignedBox3f(query), [&](float distance, std::uint32_t) { return distance < limit; },
        [&](std::size_t leaf) {
          float distances[leafSize];
          leaves_[leaf].squaredDistances(query, distances);
          for (std::size_t n = 0; n < leafSize; ++n)
            if (distances[n] < limit)
              found.push_back(rankOf(distances[n], leaves_[leaf].index[n]));
        });
    std::sort(found.begin(), found.end());
    for (const std::uint64_t rank : found) {
      result.indices.push_back(static_cast<int>(indexOf(rank)));
      result.squaredDistances.push_back(distanceOf(rank));
    }
    return static_cast<int>(found.size());
  }

  /// Answers the points of a leaf together: the points close to the leaf are gathered once and compared with all of it.
  void forEachPosition(const std::vector<Eigen::Vector3f>& positions, int k, Answer answer, Execution& execution,
                       const std::function<void(const NeighborBatch&)>& visit) const override
  {
    const std::size_t wanted = std::max(k, 0);
    if (wanted == 0 || wanted > kernels::maxNearest) {
      NeighborSearch::forEachPosition(positions, k, answer, execution, visit);
      return;
    }
    execution.forRange(leaves_.size(), leafGrain, [&](std::size_t begin, std::size_t end) {
      Group group;
      for (std::size_t leaf = begin; leaf < end; ++leaf)
        answerLeaf(leaf, wanted, answer, group, visit);
    });
  }

private:
  void clear()
  {
    size_ = 0;
    leaves_ = std::vector<Leaf>(); // {} would keep their memory
    levels_.clear();
  }

  /// Calls visit(leaf) for the leaves that may hold a wanted point, the nearest of siblings first.
  /// \param admits whether a box at this squared distance, with this smallest index, may hold a wanted point
  template <typename Admits, typename Visit>
  void descend(const Eigen::AlignedBox3f& query, const Admits& admits, const Visit& visit) const
  {
    struct Place {
      float distance;
      std::uint32_t smallestIndex, level, number; ///< level 0: a leaf
    };
    if (levels_.empty())
      return;
    std::array<Place, 16 * fanOut> stack; // each of the at most 16 levels leaves at most fanOut − 1 siblings behind
    stack[0] = {0, 0, static_cast<std::uint32_t>(levels_.size()), 0};
    for (std::size_t depth = 1; depth > 0;) {
      const Place place = stack[--depth];
      if (!admits(place.distance, place.smallestIndex))
        continue;
      if (place.level == 0) {
        visit(place.number);
        continue;
      }
      const Node& node = levels_[place.level - 1][place.number];
      const Eigen::Array4f distances = node.squaredDistances(query);
      const std::size_t base = depth;
      for (std::uint32_t c = 0; c < fanOut; ++c) {
        // A missing child is infinitely far away, but so is any child whose distance overflows: its index tells.
        if (node.smallestIndex[c] == noIndex || !admits(distances[c], node.smallestIndex[c]))
          continue;
        // The nearest on top; of equals, the one with the smallest index.
        std::size_t n = depth++;
        const auto isNearer = [&](const Place& other) {
          return other.distance < distances[c] ||
                 (other.distance == distances[c] && other.smallestIndex < node.smallestIndex[c]);
        };
        for (; n > base && isNearer(stack[n - 1]); --n)
          stack[n] = stack[n - 1];
        stack[n] = {distances[c], node.smallestIndex[c], place.level - 1,
                    place.number * static_cast<std::uint32_t>(fanOut) + c};
      }
    }
  }

  template <typename Found>
  void findNearest(const Eigen::Vector3f& query, Found& nearest) const
  {
    const auto add = [&](const Leaf& leaf) {
      float distances[leafSize];
      leaf.squaredDistances(query, distances);
      const float limit = distanceOf(nearest.end());
      for (std::size_t n = 0; n < leafSize; ++n)
        if (!(distances[n] > limit))
          nearest.add(rankOf(distances[n], leaf.index[n]));
    };
    descend(
        Eigen::AlignedBox3f(query),
        [&](float distance, std::uint32_t index) { return rankOf(distance, index) < nearest.end(); },
        [&](std::size_t leaf) { add(leaves_[leaf]); });
  }

  /// Copies the leaves within a squared distance of a box. \return false if there are too many
  bool gather(const Eigen::AlignedBox3f& around, float bound, Group& group) const
  {
    group.size = 0;
    bool fits = true;
    descend(
        around, [&](float distance, std::uint32_t) { return fits && distance <= bound; },
        [&](std::size_t leaf) {
          fits = group.size + leafSize <= maxCandidates;
          if (fits)
            group.add(leaves_[leaf]);
        });
    return fits;
  }

  void answerOne(const Eigen::Vector3f& query, std::size_t k, float* distances, std::uint32_t* indices) const
  {
    std::array<std::uint64_t, kernels::maxNearest> ranks;
    Nearest nearest(k, ranks.data());
    findNearest(query, nearest);
    for (std::size_t n = 0; n < k; ++n) {
      const bool isFound = n < nearest.size() && indexOf(ranks[n]) != noIndex;
      distances[n] = isFound ? distanceOf(ranks[n]) : infinite;
      indices[n] = isFound ? indexOf(ranks[n]) : 0;
    }
  }

  void answerLeaf(std::size_t leaf, std::size_t k, Answer answer, Group& group,
                  const std::function<void(const NeighborBatch&)>& visit) const
  {
    constexpr std::size_t lanes = kernels::queryLanes;
    static_assert(leafSize == lanes, "a leaf is answered at once");
    Leaf queries = leaves_[leaf];
    const std::size_t size = queries.size();
    Eigen::AlignedBox3f box;
    for (std::size_t q = 0; q < lanes; ++q) {
      if (q < size) {
        box.extend(queries.position(q));
        continue;
      }
      queries.x[q] = queries.x[0]; // idle lanes repeat the first query
      queries.y[q] = queries.y[0];
      queries.z[q] = queries.z[0];
    }
    // The k-th neighbors among the leaves next to it in memory limit the distance.
    group.size = 0;
    const std::size_t first = leaf / fanOut * fanOut;
    for (std::size_t n = first; n < std::min(first + fanOut, leaves_.size()); ++n)
      group.add(leaves_[n]);
    std::array<float, lanes * kernels::maxNearest> sorted;
    group.nearest(queries, k, sorted.data());
    const float* const farthest = &sorted[(k - 1) * lanes];
    const bool fits = gather(box, *std::max_element(farthest, farthest + lanes), group);
    if (fits)
      group.nearest(queries, k, sorted.data());

    std::array<float, lanes * kernels::maxNearest> distances;
    std::array<std::uint32_t, lanes * kernels::maxNearest> indices;
    std::array<std::uint64_t, maxHits> ranks;
    const bool needsIndices = answer != Answer::distances;
    for (std::size_t q = 0; q < size; ++q) {
      const std::size_t hits =
          fits && needsIndices ? group.ranksWithin(queries.position(q), farthest[q], ranks.data()) : 0;
      if (!fits || hits > maxHits || !(farthest[q] < infinite)) {
        answerOne(queries.position(q), k, &distances[q * k], &indices[q * k]);
        continue;
      }
      for (std::size_t n = 0; n < k; ++n)
        distances[q * k + n] = sorted[n * lanes + q];
      // The place of a hit is the number of hits that are nearer.
      for (std::size_t h = 0; h < hits; ++h) {
        std::size_t place = 0;
        for (std::size_t other = 0; other < hits; ++other)
          place += ranks[other] < ranks[h] ? 1 : 0;
        if (place < k)
          indices[q * k + place] = indexOf(ranks[h]);
      }
    }
    NeighborBatch batch;
    batch.size = size;
    batch.k = k;
    batch.positions = queries.index.data();
    batch.squaredDistances = distances.data();
    batch.indices = needsIndices ? indices.data() : nullptr;
    visit(batch);
  }

  std::size_t size_ = 0; ///< number of points
  std::vector<Leaf> leaves_;
  std::vector<std::vector<Node>> levels_; ///< the parents of the leaves first
  std::vector<std::uint32_t> order_;      ///< of the points in the leaves; only kept while there are no leaves
};

} // namespace

std::unique_ptr<NeighborSearch> makePointBins()
{
  return std::make_unique<PointIndex>();
}

} // namespace pcl::mrf
