// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Neighbor search on sorted uniform bins, with a tree for what bins are bad at.
#pragma once

#include <pcl/surface/mrf/neighbor_search.h>

#include "base/spatial_sort.h"
#include "points/point_tree.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

/// Cells of a side that suits the median density, sorted along a Morton curve and kept in occupied bricks of 4³ cells.
///
/// A query looks at the cells around it. What it finds there is the answer if no point outside of them can be closer;
/// otherwise (far from the points, where they are sparse, or in cells with very many) the tree over the same sorted
/// points answers. So the cells decide the speed alone, and any distribution of points is answered exactly.
class PointBins final : public NeighborSearch {
public:
  void setPoints(const std::vector<Eigen::Vector3f>& positions) override;
  void setPoints(const std::vector<Eigen::Vector3f>& positions, Execution& execution) override;
  void dropPoints(const std::vector<Eigen::Vector3f>& left, const std::vector<std::uint8_t>& keep,
                  Execution& execution) override;

  int nearest(const Eigen::Vector3f& query, int k, Neighbors& result) const override;
  int within(const Eigen::Vector3f& query, float radius, Neighbors& result) const override;
  void forEachPosition(const std::vector<Eigen::Vector3f>& positions, int k, Answer answer, Execution& execution,
                       const std::function<void(const NeighborBatch&)>& visit) const override;

private:
  /// A box of cells, both ends included.
  struct CellBox {
    Eigen::Array3i lower, upper;
  };

  struct Group;

  void sortPoints(const std::vector<Eigen::Vector3f>& positions, Execution& execution);
  void makeBricks(const SortKeys& keys, Execution& execution);
  void arrangeCrowdedCells(Execution& execution);
  double idealSide() const;

  Eigen::Array3i cellOf(const Eigen::Array3d& position) const;
  std::size_t findBrick(const Eigen::Array3i& brick) const;
  bool hasBins() const { return !starts_.empty(); }

  /// All points outside of the cells are farther from the query than this.
  float squaredClearance(const Eigen::Vector3f& query, const CellBox& cells) const;

  /// Calls visit(begin, end) on runs of sorted points that make up the cells.
  template <typename Visit>
  void forEachRun(const CellBox& cells, const Visit& visit) const;

  void findNearest(const Eigen::Vector3f& query, Nearest& nearest) const;

  /// The same for one neighbor, ranked. \pre there are points
  std::uint64_t findClosest(const Eigen::Vector3f& query) const;

  /// The same, given a squared distance that the farthest of them does not exceed. \return false if it is too large
  bool findBounded(const Eigen::Vector3f& query, float bound, Nearest& nearest) const;
  /// The k nearest of a point by its number in sorted order, filled up with infinite distances.
  void answerFromTree(std::size_t n, std::size_t k, float* distances, std::uint32_t* indices) const;
  bool gatherCandidates(const CellBox& cells, Group& group) const;
  static std::size_t findHits(const Eigen::Vector3f& query, float worst, Group& group);
  static void rankHits(const Group& group, std::size_t hits, const float* sorted, std::size_t k, float* distances,
                       std::uint32_t* indices);
  void answerBrick(std::size_t brick, Group& group, std::size_t k, Answer answer,
                   const std::function<void(const NeighborBatch&)>& visit) const;
  void answerGroup(Group& group, std::size_t k, Answer answer,
                   const std::function<void(const NeighborBatch&)>& visit) const;

  std::vector<IndexedPoint> points_;               ///< sorted by cell
  PointTree tree_;                                 ///< over points_
  double side_ = 1, inverseSide_ = 1;              ///< of a cell
  double rounding_ = 0;                            ///< what rounding may make of the distance to a cell
  Eigen::Array3d origin_ = Eigen::Array3d::Zero(); ///< lower corner of cell 0
  Eigen::Array3i base_ = Eigen::Array3i::Zero();   ///< first cell of the first brick along each axis
  std::vector<std::uint32_t> starts_;              ///< first point of each cell, brick by brick; empty: no bins
  std::vector<std::uint64_t> occupied_;            ///< one bit per cell of each brick that has points
  std::vector<std::uint64_t> brickKeys_;           ///< hash table with open addressing; 0 = free
  std::vector<std::uint32_t> brickNumbers_;        ///< what the table holds
};

} // namespace mrf
} // namespace pcl
