// SPDX-License-Identifier: BSD-3-Clause
#include "points/point_bins.h"

#include <pcl/surface/mrf/point_set.h>

#include "base/select_values.h"
#include "points/nearest_kernels.h"
#include "points/point_frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace pcl {
namespace mrf {
namespace {

/// Points, or bricks of about so many, per piece of parallel work.
constexpr std::int64_t binGrain = 4096;
constexpr std::int64_t brickGrain = 64;

constexpr int cellBits = 21;
constexpr int brickSide = 4;
constexpr std::size_t brickCells = 64;

/// Cells of a side of so many median distances to the 8th neighbor: measured, flat from .9 to 1.2.
constexpr double sidePerEighth = 1.05;

/// Squares near the smallest float are rounded to multiples of it. A squared distance, the sum of three, may be off by
/// this much in all: down to zero for points that differ.
constexpr double underflow = 4 * double{std::numeric_limits<float>::denorm_min()};

/// Cells with more points are arranged for the tree.
constexpr std::size_t crowded = 16;

/// Fewer points per brick than this, and the tables cost more than they save.
constexpr std::size_t minPerBrick = 4;

/// More neighbors than this the tree finds as fast.
constexpr int maxFromBins = 32;

/// The cells of a brick are numbered by a Morton code of two bits per axis; this is one bit per cell for those with a
/// coordinate first..last along an axis.
constexpr std::uint64_t slab(int axis, int first, int last)
{
  std::uint64_t mask = 0;
  for (int cell = 0; cell < 64; ++cell) {
    const int coordinate = (cell >> axis & 1) | (cell >> (axis + 2) & 2);
    if (coordinate >= first && coordinate <= last)
      mask |= std::uint64_t{1} << cell;
  }
  return mask;
}

/// The same for all axes and ranges.
struct Slabs {
  std::uint64_t masks[3][brickSide][brickSide] = {};

  constexpr Slabs()
  {
    for (int axis = 0; axis < 3; ++axis)
      for (int first = 0; first < brickSide; ++first)
        for (int last = 0; last < brickSide; ++last)
          masks[axis][first][last] = slab(axis, first, last);
  }

  /// Of a box of cells' range along an axis, the part in a brick.
  std::uint64_t within(int axis, int brick, int lower, int upper) const
  {
    const int corner = brickSide * brick;
    return masks[axis][std::max(lower - corner, 0)][std::min(upper - corner, brickSide - 1)];
  }
};
constexpr Slabs slabs;

/// Number of zeros below the lowest one. \pre bits != 0
int lowestBit(std::uint64_t bits)
{
  return __builtin_ctzll(bits);
}

/// A brick as a key of the hash table, never 0.
std::uint64_t packed(const Eigen::Array3i& brick)
{
  return std::uint64_t{1} << 63 | static_cast<std::uint64_t>(brick.z()) << 40 |
         static_cast<std::uint64_t>(brick.y()) << 20 | static_cast<std::uint64_t>(brick.x());
}

std::size_t slotOf(std::uint64_t key, std::size_t capacity)
{
  return static_cast<std::size_t>(key * 0x9e3779b97f4a7c15 >> 32) & (capacity - 1);
}

constexpr std::size_t noBrick = std::numeric_limits<std::size_t>::max();

/// Room for the points of a box of cells, to be compared with several queries.
constexpr std::size_t maxCandidates = 768;

/// So many points a single query looks at before it asks the tree; a surface has about 40 around it, a volume 70.
constexpr std::size_t maxPerQuery = 160;

} // namespace

std::unique_ptr<NeighborSearch> makePointBins()
{
  return std::make_unique<PointBins>();
}

void PointBins::setPoints(const std::vector<Eigen::Vector3f>& positions)
{
  Execution serial(1);
  setPoints(positions, serial);
}

void PointBins::setPoints(const std::vector<Eigen::Vector3f>& positions, Execution& execution)
{
  const auto lay = [&](const Eigen::Array3d& center, double side) {
    side_ = std::max(side, 1e-300);
    inverseSide_ = 1 / side_;
    origin_ = center - side_ * (1 << (cellBits - 1));
    rounding_ = 1e-6 * side_ + 1e-14 * origin_.abs().maxCoeff();
    sortPoints(positions, execution);
    tree_.build(points_, execution);
  };
  if (positions.empty()) {
    points_.clear();
    starts_.clear();
    tree_.build(points_, execution);
    return;
  }
  const PointFrame frame = estimateFrame(positions);
  lay(frame.center, frame.side);
  const double ideal = idealSide();
  constexpr double tolerance = 1.35;
  if (ideal > 0 && (side_ > tolerance * ideal || tolerance * side_ < ideal))
    lay(frame.center, ideal);
}

void PointBins::dropPoints(const std::vector<Eigen::Vector3f>& left, const std::vector<std::uint8_t>& keep,
                           Execution& execution)
{
  // With many less the cells do not suit what is left.
  constexpr std::size_t few = 8;
  if (left.empty() || (keep.size() - left.size()) * few > keep.size()) {
    setPoints(left, execution);
    return;
  }
  std::vector<std::uint32_t> numbers(keep.size());
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    numbers[i] = next;
    next += keep[i] ? 1 : 0;
  }
  std::size_t kept = 0;
  const auto move = [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      if (keep[points_[n].index]) {
        points_[kept] = points_[n];
        points_[kept++].index = numbers[points_[n].index];
      }
  };
  if (hasBins()) {
    std::size_t begin = 0;
    for (std::size_t cell = 0; cell + 1 < starts_.size(); ++cell) {
      const std::size_t end = starts_[cell + 1];
      starts_[cell] = static_cast<std::uint32_t>(kept);
      move(begin, end);
      if (starts_[cell] == kept)
        occupied_[cell / brickCells] &= ~(std::uint64_t{1} << cell % brickCells);
      begin = end;
    }
    starts_.back() = static_cast<std::uint32_t>(kept);
  } else {
    move(0, points_.size());
  }
  points_.resize(kept);
  tree_.build(points_, execution);
}

Eigen::Array3i PointBins::cellOf(const Eigen::Array3d& position) const
{
  // Clamped: beyond the last cells there are only far outliers. They count as members of those.
  constexpr double last = (1 << cellBits) - 1;
  return ((position - origin_) * inverseSide_).max(0).min(last).cast<int>();
}

void PointBins::sortPoints(const std::vector<Eigen::Vector3f>& positions, Execution& execution)
{
  const auto count = static_cast<std::int64_t>(positions.size());
  SortKeys keys(positions.size());
  std::vector<std::uint32_t> order(positions.size());
  const auto cellAt = [&](std::size_t i) { return cellOf(positions[i].array().cast<double>()); };
  base_ = cellOf(boundingBox(positions).lower.array().cast<double>());
  base_ -= base_.unaryExpr([](int cell) { return cell % brickSide; });
  execution.forRange(count, binGrain, [&](std::int64_t begin, std::int64_t end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const Eigen::Array3i cell = cellAt(i) - base_;
      keys[i] = mortonCode(static_cast<std::uint32_t>(cell.x()), static_cast<std::uint32_t>(cell.y()),
                           static_cast<std::uint32_t>(cell.z()));
      order[i] = static_cast<std::uint32_t>(i);
    }
  });
  sortByKey(keys, order, execution);
  points_.resize(positions.size());
  execution.forRange(count, binGrain, [&](std::int64_t begin, std::int64_t end) {
    for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n) {
      const Eigen::Vector3f& position = positions[order[n]];
      points_[n] = {position.x(), position.y(), position.z(), order[n]};
    }
  });
  makeBricks(keys, execution);
  arrangeCrowdedCells(execution);
}

void PointBins::makeBricks(const SortKeys& keys, Execution& execution)
{
  starts_.clear();
  std::vector<std::uint32_t> firsts; // point of each brick
  for (std::size_t n = 0; n < keys.size(); ++n)
    if (n == 0 || keys[n] >> 6 != keys[n - 1] >> 6)
      firsts.push_back(static_cast<std::uint32_t>(n));
  const std::size_t bricks = firsts.size();
  if (bricks * minPerBrick > keys.size() && bricks > 1)
    return;
  firsts.push_back(static_cast<std::uint32_t>(keys.size()));

  starts_.resize(bricks * brickCells + 1);
  occupied_.assign(bricks, 0);
  starts_.back() = firsts.back();
  execution.forRange(static_cast<std::int64_t>(bricks), brickGrain, [&](std::int64_t begin, std::int64_t end) {
    for (auto b = static_cast<std::size_t>(begin); b < static_cast<std::size_t>(end); ++b) {
      std::uint32_t n = firsts[b];
      for (std::size_t cell = 0; cell < brickCells; ++cell) {
        starts_[b * brickCells + cell] = n;
        for (; n < firsts[b + 1] && (keys[n] & (brickCells - 1)) == cell; ++n)
          occupied_[b] |= std::uint64_t{1} << cell;
      }
    }
  });

  std::size_t capacity = 16;
  while (capacity < 2 * bricks)
    capacity *= 2;
  brickKeys_.assign(capacity, 0);
  brickNumbers_.assign(capacity, 0);
  for (std::size_t b = 0; b < bricks; ++b) {
    const IndexedPoint& point = points_[firsts[b]];
    const Eigen::Array3i brick = (cellOf({point.x, point.y, point.z}) - base_) / brickSide;
    const std::uint64_t key = packed(brick);
    std::size_t slot = slotOf(key, capacity);
    while (brickKeys_[slot] != 0)
      slot = (slot + 1) & (capacity - 1);
    brickKeys_[slot] = key;
    brickNumbers_[slot] = static_cast<std::uint32_t>(b);
  }
}

void PointBins::arrangeCrowdedCells(Execution& execution)
{
  if (!hasBins()) {
    // Cells that are far from suiting the points say nothing about their order.
    PointTree::arrange(points_, 0, points_.size());
    return;
  }
  execution.forRange(static_cast<std::int64_t>(starts_.size() - 1), brickGrain * brickCells,
                     [&](std::int64_t begin, std::int64_t end) {
                       for (auto cell = static_cast<std::size_t>(begin); cell < static_cast<std::size_t>(end); ++cell)
                         if (starts_[cell + 1] - starts_[cell] > crowded)
                           PointTree::arrange(points_, starts_[cell], starts_[cell + 1]);
                     });
}

double PointBins::idealSide() const
{
  constexpr std::size_t neighbors = 9; // the point itself among them
  std::array<float, neighbors> distances;
  std::array<std::uint32_t, neighbors> indices;
  std::vector<float> eighths;
  for (const std::size_t n : sampleOf(points_.size(), 64)) {
    Nearest nearest(neighbors, distances.data(), indices.data());
    tree_.findNearest({points_[n].x, points_[n].y, points_[n].z}, nearest);
    if (nearest.size() == neighbors)
      eighths.push_back(std::sqrt(distances.back()));
  }
  if (eighths.empty())
    return 0;
  return sidePerEighth * median(std::move(eighths));
}

std::size_t PointBins::findBrick(const Eigen::Array3i& brick) const
{
  const std::uint64_t key = packed(brick);
  const std::size_t capacity = brickKeys_.size();
  for (std::size_t slot = slotOf(key, capacity); brickKeys_[slot] != 0; slot = (slot + 1) & (capacity - 1))
    if (brickKeys_[slot] == key)
      return brickNumbers_[slot];
  return noBrick;
}

float PointBins::squaredClearance(const Eigen::Vector3f& query, const CellBox& cells) const
{
  constexpr int last = (1 << cellBits) - 1;
  double result = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    // The first and the last cells hold all that is beyond them.
    if (cells.lower[axis] > 0)
      result = std::min(result, query[axis] - (origin_[axis] + cells.lower[axis] * side_));
    if (cells.upper[axis] < last)
      result = std::min(result, origin_[axis] + (cells.upper[axis] + 1) * side_ - query[axis]);
  }
  const double clear = std::max(0., .999999 * (result - rounding_));
  return static_cast<float>(std::max(0., clear * clear - underflow));
}

template <typename Visit>
void PointBins::forEachRun(const CellBox& cells, const Visit& visit) const
{
  const Eigen::Array3i lower = (cells.lower - base_).max(0), upper = cells.upper - base_;
  if ((upper < 0).any())
    return;
  const Eigen::Array3i first = lower / brickSide, last = upper / brickSide;
  for (int bz = first.z(); bz <= last.z(); ++bz) {
    const std::uint64_t inZ = slabs.within(2, bz, lower.z(), upper.z());
    for (int by = first.y(); by <= last.y(); ++by) {
      const std::uint64_t inYZ = inZ & slabs.within(1, by, lower.y(), upper.y());
      for (int bx = first.x(); bx <= last.x(); ++bx) {
        const std::size_t brick = findBrick({bx, by, bz});
        if (brick == noBrick)
          continue;
        const std::uint64_t wanted = inYZ & slabs.within(0, bx, lower.x(), upper.x());
        const std::uint32_t* starts = starts_.data() + brick * brickCells;
        // Cells with consecutive numbers are one run.
        for (std::uint64_t left = wanted & occupied_[brick]; left != 0;) {
          const int begin = lowestBit(left);
          const std::uint64_t beyond = ~(wanted >> begin);
          const int end = begin + (beyond != 0 ? lowestBit(beyond) : static_cast<int>(brickCells));
          visit(std::size_t{starts[begin]}, std::size_t{starts[end]});
          left = end < static_cast<int>(brickCells) ? left & (~std::uint64_t{0} << end) : 0;
        }
      }
    }
  }
}

bool PointBins::findBounded(const Eigen::Vector3f& query, float bound, Nearest& nearest) const
{
  constexpr double maxCells = 2.5; // farther, the tree is faster
  const double reach = 1.000001 * std::sqrt(double{bound} + underflow);
  if (!(reach < maxCells * side_))
    return false;
  const Eigen::Array3d position = query.array().cast<double>();
  std::size_t seen = 0;
  forEachRun({cellOf(position - reach), cellOf(position + reach)}, [&](std::size_t begin, std::size_t end) {
    seen += end - begin;
    for (std::size_t n = begin; n < end && seen <= maxPerQuery; ++n)
      nearest.add(points_[n].squaredDistanceTo(query), points_[n].index);
  });
  return seen <= maxPerQuery;
}

std::uint64_t PointBins::findClosest(const Eigen::Vector3f& query) const
{
  std::uint64_t closest = std::numeric_limits<std::uint64_t>::max();
  const auto isFoundIn = [&](const CellBox& cells, std::size_t& seen) {
    forEachRun(cells, [&](std::size_t begin, std::size_t end) {
      seen += end - begin;
      if (seen <= maxPerQuery)
        for (std::size_t n = begin; n < end; ++n)
          closest = std::min(closest, ranked(points_[n].squaredDistanceTo(query), points_[n].index));
    });
    return seen > 0 && seen <= maxPerQuery && distanceOf(closest) < squaredClearance(query, cells);
  };
  if (hasBins()) {
    constexpr int last = (1 << cellBits) - 1;
    constexpr double sparse = 3; // cells; farther away the tree is as fast
    const Eigen::Array3d position = query.array().cast<double>();
    const Eigen::Array3i corner = cellOf(position - .5 * side_);
    std::size_t few = 0, more = 0;
    if (isFoundIn({corner, (corner + 1).min(last)}, few))
      return closest;
    if (few <= maxPerQuery && isFoundIn({cellOf(position - sparse * side_), cellOf(position + sparse * side_)}, more))
      return closest;
  }
  return tree_.findClosest(query, closest);
}

void PointBins::findNearest(const Eigen::Vector3f& query, Nearest& nearest) const
{
  if (nearest.capacity() == 1) {
    const std::uint64_t closest = findClosest(query);
    nearest.add(distanceOf(closest), static_cast<std::uint32_t>(closest));
    return;
  }
  const auto isFoundIn = [&](const CellBox& cells) {
    nearest.clear();
    std::size_t seen = 0;
    forEachRun(cells, [&](std::size_t begin, std::size_t end) {
      seen += end - begin;
      // The tree prunes what is in crowded cells.
      for (std::size_t n = begin; n < end && seen <= maxPerQuery; ++n)
        nearest.add(points_[n].squaredDistanceTo(query), points_[n].index);
    });
    return seen <= maxPerQuery && nearest.worst() < squaredClearance(query, cells);
  };
  if (hasBins() && nearest.capacity() <= maxFromBins) {
    constexpr int last = (1 << cellBits) - 1;
    const Eigen::Array3d position = query.array().cast<double>();
    // A few neighbors are mostly in the eight cells around the nearest corner.
    const bool few = nearest.capacity() <= 4;
    const Eigen::Array3i lower = few ? cellOf(position - .5 * side_) : (cellOf(position) - 1).max(0);
    if (isFoundIn({lower, (lower + (few ? 1 : 2)).min(last)}))
      return;
    if (nearest.size() == nearest.capacity()) {
      const float bound = nearest.worst();
      nearest.clear();
      if (findBounded(query, bound, nearest))
        return;
    }
  }
  nearest.clear();
  tree_.findNearest(query, nearest);
}

int PointBins::nearest(const Eigen::Vector3f& query, int k, Neighbors& result) const
{
  const std::size_t room = std::min(static_cast<std::size_t>(std::max(k, 0)), points_.size());
  result.indices.resize(room);
  result.squaredDistances.resize(room);
  if (room == 0 || !query.allFinite()) {
    result.indices.clear();
    result.squaredDistances.clear();
    return 0;
  }
  // Unsigned values may be written through pointers to their signed type.
  Nearest nearest(room, result.squaredDistances.data(), reinterpret_cast<std::uint32_t*>(result.indices.data()));
  findNearest(query, nearest);
  return static_cast<int>(room);
}

int PointBins::within(const Eigen::Vector3f& query, float radius, Neighbors& result) const
{
  result.indices.clear();
  result.squaredDistances.clear();
  if (!query.allFinite() || !(radius > 0))
    return 0;
  const auto limit = static_cast<float>(double{radius} * radius);
  std::vector<std::uint64_t> found;
  const auto add = [&](float distance, std::uint32_t index) { found.push_back(ranked(distance, index)); };
  constexpr double maxCells = 2; // from the center; farther, the tree is faster
  if (hasBins() && radius < maxCells * side_) {
    const Eigen::Array3d position = query.array().cast<double>();
    const double reach = 1.000001 * std::sqrt(double{radius} * radius + underflow);
    forEachRun({cellOf(position - reach), cellOf(position + reach)}, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) {
        const float distance = points_[n].squaredDistanceTo(query);
        if (distance < limit)
          add(distance, points_[n].index);
      }
    });
  } else {
    tree_.findWithin(query, limit, add);
  }
  std::sort(found.begin(), found.end());
  result.indices.reserve(found.size());
  result.squaredDistances.reserve(found.size());
  for (const std::uint64_t entry : found) {
    result.indices.push_back(static_cast<int>(entry & 0xffffffff));
    result.squaredDistances.push_back(distanceOf(entry));
  }
  return static_cast<int>(found.size());
}

/// Queries close together, and what is around them.
struct PointBins::Group {
  std::size_t size = 0;
  CellBox cells;                                         ///< of the queries
  std::array<std::uint32_t, kernels::queryLanes> points; ///< their numbers in sorted order

  std::size_t candidates = 0;
  std::array<float, maxCandidates> x, y, z;
  std::array<std::uint32_t, maxCandidates> indices;
  std::array<float, maxCandidates> distances;
  std::array<std::uint32_t, maxCandidates> hits;

  std::array<float, kernels::queryLanes * maxFromBins> answers;
  std::array<std::uint32_t, kernels::queryLanes * maxFromBins> answerIndices;
};

/// Copies the points of some cells. \return false if they are too many
bool PointBins::gatherCandidates(const CellBox& cells, Group& group) const
{
  group.candidates = 0;
  bool fits = true;
  forEachRun(cells, [&](std::size_t begin, std::size_t end) {
    fits = fits && group.candidates + (end - begin) <= maxCandidates;
    for (std::size_t n = begin; n < end && fits; ++n) {
      group.x[group.candidates] = points_[n].x;
      group.y[group.candidates] = points_[n].y;
      group.z[group.candidates] = points_[n].z;
      group.indices[group.candidates++] = points_[n].index;
    }
  });
  return fits;
}

/// Lists the candidates within a squared distance. \return how many
std::size_t PointBins::findHits(const Eigen::Vector3f& query, float worst, Group& group)
{
  kernels::distances(group.candidates, group.x.data(), group.y.data(), group.z.data(), query.x(), query.y(), query.z(),
                     group.distances.data());
  std::size_t hits = 0;
  for (std::size_t c = 0; c < group.candidates; ++c) { // without a branch: which ones hit cannot be predicted
    group.hits[hits] = static_cast<std::uint32_t>(c);
    hits += group.distances[c] <= worst ? 1 : 0;
  }
  return hits;
}

/// Puts the hits of a query to the places that their distances have among the sorted ones.
void PointBins::rankHits(const Group& group, std::size_t hits, const float* sorted, std::size_t k, float* distances,
                         std::uint32_t* indices)
{
  std::array<float, kernels::queryLanes> ascending; // of a fixed number, for the sake of vectors
  ascending.fill(std::numeric_limits<float>::infinity());
  for (std::size_t n = 0; n < k; ++n)
    ascending[n] = sorted[n * kernels::queryLanes];
  if (hits == k) {
    std::uint32_t taken = 0;
    for (std::size_t h = 0; h < hits; ++h) {
      const float distance = group.distances[group.hits[h]];
      std::uint32_t rank = 0;
      for (const float value : ascending)
        rank += value < distance ? 1 : 0;
      taken |= 1u << rank;
      distances[rank] = distance;
      indices[rank] = group.indices[group.hits[h]];
    }
    if (taken == (1u << k) - 1)
      return;
  }
  // Some are equal: the smaller indices go first.
  Nearest nearest(k, distances, indices);
  for (std::size_t h = 0; h < hits; ++h)
    nearest.add(group.distances[group.hits[h]], group.indices[group.hits[h]]);
}

void PointBins::forEachPosition(const std::vector<Eigen::Vector3f>& positions, int k, Answer answer,
                                Execution& execution, const std::function<void(const NeighborBatch&)>& visit) const
{
  const auto wanted = static_cast<std::size_t>(std::max(k, 0));
  if (wanted == 0 || wanted > kernels::maxNearest) {
    NeighborSearch::forEachPosition(positions, k, answer, execution, visit);
    return;
  }
  if (!hasBins()) {
    execution.forRange(static_cast<std::int64_t>(points_.size()), binGrain / 8,
                       [&](std::int64_t begin, std::int64_t end) {
                         std::array<float, kernels::maxNearest> distances;
                         std::array<std::uint32_t, kernels::maxNearest> indices;
                         for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n) {
                           answerFromTree(n, wanted, distances.data(), indices.data());
                           NeighborBatch batch;
                           batch.size = 1;
                           batch.k = wanted;
                           batch.positions = &points_[n].index;
                           batch.squaredDistances = distances.data();
                           batch.indices = answer == Answer::distances ? nullptr : indices.data();
                           visit(batch);
                         }
                       });
    return;
  }
  execution.forRange(static_cast<std::int64_t>((starts_.size() - 1) / brickCells), brickGrain,
                     [&](std::int64_t begin, std::int64_t end) {
                       Group group;
                       for (auto b = static_cast<std::size_t>(begin); b < static_cast<std::size_t>(end); ++b)
                         answerBrick(b, group, wanted, answer, visit);
                     });
}

void PointBins::answerFromTree(std::size_t n, std::size_t k, float* distances, std::uint32_t* indices) const
{
  Nearest nearest(k, distances, indices);
  tree_.findNearest({points_[n].x, points_[n].y, points_[n].z}, nearest, tree_.boundFromMemory(n, k));
  std::fill(distances + nearest.size(), distances + k, std::numeric_limits<float>::infinity());
  std::fill(indices + nearest.size(), indices + k, 0u);
}

void PointBins::answerBrick(std::size_t brick, Group& group, std::size_t k, Answer answer,
                            const std::function<void(const NeighborBatch&)>& visit) const
{
  if (occupied_[brick] == 0)
    return; // its points were dropped
  const std::uint32_t* starts = starts_.data() + brick * brickCells;
  const IndexedPoint& some = points_[starts[0]];
  const Eigen::Array3i any = cellOf({some.x, some.y, some.z}) - base_;
  const Eigen::Array3i corner = base_ + any - any.unaryExpr([](int cell) { return cell % brickSide; });
  group.size = 0;
  for (std::size_t code = 0; code < brickCells; ++code) {
    const auto axisOf = [code](int axis) { return static_cast<int>((code >> axis & 1) | (code >> (axis + 2) & 2)); };
    const Eigen::Array3i cell = corner + Eigen::Array3i(axisOf(0), axisOf(1), axisOf(2));
    for (std::uint32_t n = starts[code]; n < starts[code + 1]; ++n) {
      if (group.size == 0)
        group.cells = {cell, cell};
      group.cells.lower = group.cells.lower.min(cell);
      group.cells.upper = group.cells.upper.max(cell);
      group.points[group.size++] = n;
      if (group.size == kernels::queryLanes) {
        answerGroup(group, k, answer, visit);
        group.size = 0;
      }
    }
  }
  if (group.size > 0)
    answerGroup(group, k, answer, visit);
}

void PointBins::answerGroup(Group& group, std::size_t k, Answer answer,
                            const std::function<void(const NeighborBatch&)>& visit) const
{
  constexpr std::size_t lanes = kernels::queryLanes;
  constexpr int last = (1 << cellBits) - 1;
  const CellBox around{(group.cells.lower - 1).max(0), (group.cells.upper + 1).min(last)};
  const bool fits = gatherCandidates(around, group);
  std::array<float, lanes> x, y, z;
  for (std::size_t q = 0; q < lanes; ++q) {
    // Idle lanes repeat the last query.
    const IndexedPoint& point = points_[group.points[std::min(q, group.size - 1)]];
    x[q] = point.x;
    y[q] = point.y;
    z[q] = point.z;
  }
  std::array<float, lanes * kernels::maxNearest> sorted;
  if (fits)
    kernels::nearestDistances(group.candidates, group.x.data(), group.y.data(), group.z.data(), x.data(), y.data(),
                              z.data(), k, sorted.data());

  std::array<std::uint32_t, lanes> positions;
  for (std::size_t q = 0; q < group.size; ++q) {
    positions[q] = points_[group.points[q]].index;
    const Eigen::Vector3f query(x[q], y[q], z[q]);
    float* distances = group.answers.data() + q * k;
    std::uint32_t* indices = group.answerIndices.data() + q * k;
    const float worst = fits ? sorted[(k - 1) * lanes + q] : std::numeric_limits<float>::infinity();
    if (!(worst < squaredClearance(query, around))) {
      Nearest nearest(k, distances, indices);
      if (!findBounded(query, worst, nearest))
        answerFromTree(group.points[q], k, distances, indices);
      continue;
    }
    if (answer == Answer::distances) {
      for (std::size_t n = 0; n < k; ++n)
        distances[n] = sorted[n * lanes + q];
      continue;
    }
    rankHits(group, findHits(query, worst, group), &sorted[q], k, distances, indices);
  }
  NeighborBatch batch;
  batch.size = group.size;
  batch.k = k;
  batch.positions = positions.data();
  batch.squaredDistances = group.answers.data();
  batch.indices = answer == Answer::distances ? nullptr : group.answerIndices.data();
  visit(batch);
}

} // namespace mrf
} // namespace pcl
