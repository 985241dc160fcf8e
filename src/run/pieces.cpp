// SPDX-License-Identifier: BSD-3-Clause
#include "run/pieces.h"

#include "base/cell_hash.h"
#include "base/disjoint_sets.h"
#include "options/stage_timer.h"
#include "pilot/volume.h"
#include "points/preprocessing.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>
#include <utility>

namespace pcl::mrf {
namespace {

/// Maximum number of cells along the longest axis at first.
constexpr double maxCells = 1 << 20;

/// A group with fewer points is no object. Such groups may hold at most this share of the points if a cloud is split.
constexpr std::int64_t minPointsOfObject = 12;
constexpr double largestShareOfRest = .1;

/// Minimum width of the gaps, in diagonals of the largest group's box.
constexpr double gapPerDiagonal = 4;

struct Group {
  std::int64_t points = 0;
  Eigen::AlignedBox3f box;

  void add(const Eigen::Vector3f& position)
  {
    ++points;
    box.extend(position);
  }
  void add(const Group& other)
  {
    points += other.points;
    box.extend(other.box);
  }
  double diagonal() const { return box.sizes().cast<double>().norm(); }
};

/// The occupied cells of a grid with their contents.
struct Cells {
  CellHash hash;
  std::vector<Group> contents;

  template <typename Content>
  void add(const CellHash::Cell& cell, const Content& content)
  {
    const std::uint32_t number = hash.add(cell);
    contents.resize(hash.size());
    contents[number].add(content);
  }

  /// The same in cells twice as wide.
  Cells merged() const
  {
    Cells result{hash.empty(), {}};
    for (std::size_t n = 0; n < contents.size(); ++n)
      result.add(hash[n] / 2, contents[n]);
    return result;
  }

  /// Partitions the cells into groups of cells that touch.
  Partition groups() const
  {
    DisjointSets sets(contents.size());
    for (std::uint32_t n = 0; n < contents.size(); ++n)
      CellHash::forEachAround(hash[n], [&](const CellHash::Cell& cell) {
        if (const std::uint32_t other = hash.find(cell); other != CellHash::none)
          sets.join(n, other);
      });
    return Partition(contents.size(), [&](std::uint32_t n) { return sets.find(n); });
  }
};

/// True if the groups are pieces: gaps of this width are wide compared with the groups, and most points are in objects.
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

/// Collects the points of each group. \param halvings log2 of the ratio of the groups' cells to the positions' cells
Pieces collect(const std::vector<Eigen::Vector3f>& positions, const Cells& cells, std::int64_t halvings,
               const Partition& groups)
{
  Pieces pieces;
  pieces.points.resize(groups.sizes.size());
  for (std::uint32_t n = 0; n < positions.size(); ++n) {
    const CellHash::Cell cell = cells.hash.cellOf(positions[n]) / (std::int64_t{1} << halvings);
    pieces.points[groups.set[cells.hash.find(cell)]].push_back(n);
  }
  std::stable_sort(pieces.points.begin(), pieces.points.end(), [](const auto& a, const auto& b) {
    return a.size() != b.size() ? a.size() > b.size() : a.front() < b.front();
  });
  for (; pieces.points.size() > 1 && pieces.points.back().size() < minPointsOfSurface; pieces.points.pop_back())
    pieces.alone.insert(pieces.alone.end(), pieces.points.back().begin(), pieces.points.back().end());
  std::sort(pieces.alone.begin(), pieces.alone.end());
  return pieces;
}

void dropAlone(const std::vector<std::uint32_t>& alone, OrientedPoints& points, NeighborSearch& search, Report& report,
               Execution& execution)
{
  if (alone.empty())
    return;
  std::vector<std::uint8_t> keep(points.size(), 1);
  for (const std::uint32_t i : alone)
    keep[i] = 0;
  points = select(std::move(points), keep);
  search.dropPoints(points.positions, keep, execution);
  report.points.alone = static_cast<std::int64_t>(alone.size());
  report.points.used -= report.points.alone;
}

} // namespace

Pieces findPieces(const std::vector<Eigen::Vector3f>& positions, float minGap)
{
  const BoundingBox box = boundingBox(positions);
  const double side = (box.upper - box.lower).cast<double>().maxCoeff();
  double gap = minGap;
  while (side / gap >= maxCells)
    gap *= 2;
  if (!(side > gap))
    return {};
  Cells cells{CellHash(box.lower.cast<double>(), gap), {}};
  for (const Eigen::Vector3f& position : positions)
    cells.add(cells.hash.cellOf(position), position);
  for (int halvings = 0;; ++halvings, gap *= 2) {
    const Partition partition = cells.groups();
    if (partition.sizes.size() == 1)
      return {};
    std::vector<Group> groups(partition.sizes.size());
    for (std::size_t n = 0; n < cells.contents.size(); ++n)
      groups[partition.set[n]].add(cells.contents[n]);
    if (arePieces(groups, gap, minGap))
      return collect(positions, cells, halvings, partition);
    cells = cells.merged();
  }
}

CloudPieces::CloudPieces(OrientedPoints& points, NeighborSearch& search, const Options& options, Report& report,
                         Execution& execution)
{
  // A gap between pieces must exceed the holes to fill, and the boxes with their padding must not overlap.
  const auto voxels = static_cast<float>(8 * (resolvedPadding(options.multiscale) + 2));
  const float minGap = std::max(options.trimming.maxHole, voxels * options.multiscale.voxelSize);
  const Pieces found = findPieces(points.positions, minGap);
  if (found.points.size() > 1)
    for (const std::vector<std::uint32_t>& piece : found.points) {
      points_.push_back(select(points, piece));
      searches_.push_back(makeSearch(options.search));
      searches_.back()->setPoints(points_.back().positions, execution);
    }
  dropAlone(found.alone, points, search, report, execution);
  for (std::size_t n = 0; n < points_.size(); ++n)
    pieces_.push_back({&points_[n], searches_[n].get(), boundingBox(points_[n].positions)});
  if (pieces_.empty())
    pieces_.push_back({&points, &search, boundingBox(points.positions)});
}

float CloudPieces::largestDiagonal() const
{
  float largest = 0;
  for (const SolvedPiece& piece : pieces_)
    largest = std::max(largest, boundingBox(piece.points->positions).diagonal());
  return largest;
}

void CloudPieces::growVolumes(const Options& options, Report& report, Execution& execution)
{
  if (options.multiscale.padding > 0)
    return;
  const StageTimer timer("volume", report, execution);
  const float maxHole =
      options.trimming.kind == Trimming::none ? std::numeric_limits<float>::infinity() : options.trimming.maxHole;
  for (SolvedPiece& piece : pieces_)
    piece.volume = chooseVolume(*piece.points, *piece.search, report.density.spacing, options, maxHole, execution);
}

} // namespace pcl::mrf
