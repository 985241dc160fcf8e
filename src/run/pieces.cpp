// SPDX-License-Identifier: BSD-3-Clause
#include "run/pieces.h"

#include "mesh/mesh_topology.h"
#include "points/preprocessing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace pcl {
namespace mrf {
namespace {

/// Cells are numbered along each axis in this many bits of their key; x in the lowest ones.
constexpr int axisBits = 20;

/// Groups of fewer points are no objects if they make up more than this share of the cloud.
constexpr std::int64_t minPointsOfObject = 12;
constexpr double largestShareOfRest = .1;

/// Gaps in diagonals of the largest group.
constexpr double gapPerDiagonal = 4;

using Key = std::uint64_t;

Key keyOf(std::int64_t x, std::int64_t y, std::int64_t z)
{
  return static_cast<Key>(x) | static_cast<Key>(y) << axisBits | static_cast<Key>(z) << 2 * axisBits;
}

std::int64_t coordinate(Key key, int axis)
{
  return static_cast<std::int64_t>(key >> (axis * axisBits) & ((Key{1} << axisBits) - 1));
}

Key parentOf(Key key)
{
  return keyOf(coordinate(key, 0) / 2, coordinate(key, 1) / 2, coordinate(key, 2) / 2);
}

struct Group {
  std::int64_t points = 0;
  Eigen::Array3f lower = Eigen::Array3f::Constant(std::numeric_limits<float>::infinity()), upper = -lower;

  void add(const Eigen::Vector3f& position)
  {
    ++points;
    lower = lower.min(position.array());
    upper = upper.max(position.array());
  }
  void add(const Group& other)
  {
    points += other.points;
    lower = lower.min(other.lower);
    upper = upper.max(other.upper);
  }
  double diagonal() const { return (upper - lower).cast<double>().matrix().norm(); }
};

/// The occupied cells of a grid, by their keys, and what is in each.
struct Cells {
  std::vector<Key> keys;
  std::vector<Group> contents;

  /// Number of the cell with a key; −1 if it is empty.
  std::int64_t find(Key key) const
  {
    const auto at = std::lower_bound(keys.begin(), keys.end(), key);
    return at != keys.end() && *at == key ? at - keys.begin() : -1;
  }

  /// Orders cells by their keys and unites those with the same one.
  void unite()
  {
    std::vector<std::size_t> order(keys.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return keys[a] < keys[b]; });
    Cells united;
    for (const std::size_t n : order) {
      if (united.keys.empty() || united.keys.back() != keys[n]) {
        united.keys.push_back(keys[n]);
        united.contents.emplace_back();
      }
      united.contents.back().add(contents[n]);
    }
    *this = std::move(united);
  }
};

/// Puts positions into cells of a side. \pre at most 2²⁰ cells along each axis of the positions' box
class CellNumbering {
public:
  CellNumbering(const Eigen::Vector3f& lower, double side) : lower_(lower.cast<double>()), side_(side) {}

  Key operator()(const Eigen::Vector3f& position) const
  {
    const Eigen::Array3d cell = ((position.cast<double>() - lower_) / side_).array().max(0).min((1 << axisBits) - 1);
    return keyOf(static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
                 static_cast<std::int64_t>(cell.z()));
  }

private:
  Eigen::Vector3d lower_;
  double side_;
};

Cells fill(const std::vector<Eigen::Vector3f>& positions, const CellNumbering& numbering)
{
  Cells cells;
  // Points come along a space-filling curve: those of a cell follow each other, but for a few interruptions.
  for (const Eigen::Vector3f& position : positions) {
    const Key key = numbering(position);
    if (cells.keys.empty() || cells.keys.back() != key) {
      cells.keys.push_back(key);
      cells.contents.emplace_back();
    }
    cells.contents.back().add(position);
  }
  cells.unite();
  return cells;
}

/// Group of each cell, numbered by their first cells. \return number of groups
std::size_t groupTouching(const Cells& cells, std::vector<std::size_t>& groupOf)
{
  DisjointSets sets(cells.keys.size());
  constexpr std::int64_t last = (1 << axisBits) - 1;
  for (std::size_t n = 0; n < cells.keys.size(); ++n)
    for (int neighbor = 14; neighbor < 27; ++neighbor) { // those with larger keys
      const Key key = cells.keys[n];
      const std::array<std::int64_t, 3> at = {coordinate(key, 0) + neighbor % 3 - 1,
                                              coordinate(key, 1) + neighbor / 3 % 3 - 1,
                                              coordinate(key, 2) + neighbor / 9 - 1};
      if (*std::min_element(at.begin(), at.end()) < 0 || *std::max_element(at.begin(), at.end()) > last)
        continue;
      if (const std::int64_t other = cells.find(keyOf(at[0], at[1], at[2])); other >= 0)
        sets.unite(static_cast<std::int32_t>(n), static_cast<std::int32_t>(other));
    }
  constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> numberOfRoot(cells.keys.size(), none);
  groupOf.resize(cells.keys.size());
  std::size_t groups = 0;
  for (std::size_t n = 0; n < cells.keys.size(); ++n) {
    std::size_t& number = numberOfRoot[static_cast<std::size_t>(sets.find(static_cast<std::int32_t>(n)))];
    if (number == none)
      number = groups++;
    groupOf[n] = number;
  }
  return groups;
}

/// True if the groups are pieces: gaps of this width are wide beside them, and most points are in objects.
bool arePieces(const std::vector<Group>& groups, double gap, double minGap)
{
  double diagonal = 0;
  std::int64_t all = 0, rest = 0;
  for (const Group& group : groups) {
    diagonal = std::max(diagonal, group.diagonal());
    all += group.points;
    rest += group.points < minPointsOfObject ? group.points : 0;
  }
  return gap >= gapPerDiagonal * diagonal + minGap &&
         static_cast<double>(rest) <= largestShareOfRest * static_cast<double>(all);
}

Pieces collect(const std::vector<Eigen::Vector3f>& positions, const CellNumbering& numbering, int halvings,
               const Cells& cells, const std::vector<std::size_t>& groupOf, std::size_t groups)
{
  Pieces pieces;
  pieces.points.resize(groups);
  for (std::size_t n = 0; n < positions.size(); ++n) {
    Key key = numbering(positions[n]);
    for (int h = 0; h < halvings; ++h)
      key = parentOf(key);
    pieces.points[groupOf[static_cast<std::size_t>(cells.find(key))]].push_back(static_cast<std::uint32_t>(n));
  }
  std::stable_sort(pieces.points.begin(), pieces.points.end(), [](const auto& a, const auto& b) {
    return a.size() != b.size() ? a.size() > b.size() : a.front() < b.front();
  });
  for (; pieces.points.size() > 1 && pieces.points.back().size() < minPointsOfSurface; pieces.points.pop_back())
    pieces.alone.insert(pieces.alone.end(), pieces.points.back().begin(), pieces.points.back().end());
  std::sort(pieces.alone.begin(), pieces.alone.end());
  return pieces;
}

} // namespace

Pieces findPieces(const std::vector<Eigen::Vector3f>& positions, float minGap)
{
  const BoundingBox box = boundingBox(positions);
  const double side = (box.upper - box.lower).cast<double>().maxCoeff();
  if (!(minGap > 0) || !std::isfinite(side))
    throw std::invalid_argument("findPieces: needs finite positions and a gap > 0");
  double gap = minGap;
  while (side / gap >= 1 << axisBits)
    gap *= 2;
  if (!(side > gap))
    return {};
  const CellNumbering numbering(box.lower, gap);
  Cells cells = fill(positions, numbering);
  std::vector<std::size_t> groupOf;
  for (int halvings = 0;; ++halvings, gap *= 2) {
    const std::size_t count = groupTouching(cells, groupOf);
    if (count == 1)
      return {};
    std::vector<Group> groups(count);
    for (std::size_t n = 0; n < cells.keys.size(); ++n)
      groups[groupOf[n]].add(cells.contents[n]);
    if (arePieces(groups, gap, minGap))
      return collect(positions, numbering, halvings, cells, groupOf, count);
    for (Key& key : cells.keys)
      key = parentOf(key);
    cells.unite();
  }
}

} // namespace mrf
} // namespace pcl
