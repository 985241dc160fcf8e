// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Points in a hash of cubic cells, which grows point by point.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {
namespace scan {

/// Queries are thread-safe while no point is added.
class PointGrid {
public:
  /// \param expected number of points, to reserve for
  PointGrid(double side, std::size_t expected);

  /// Adds a point with its normal.
  void add(const Eigen::Vector3d& position, const Eigen::Vector3d& normal);

  std::size_t size() const { return points_.size(); }

  /// True if a point is closer than radius and faces the same side as the normal: the two sides of a thin plate do not
  /// see each other.
  /// \pre radius is at most half of the cells' side
  bool hasWithin(const Eigen::Vector3d& position, const Eigen::Vector3d& normal, double radius) const;

  /// Distance of point i to the closest other point at another place; infinite if there is none.
  double nearestOther(std::size_t i) const;

private:
  using Cell = Eigen::Matrix<std::int64_t, 3, 1>;
  /// One cache line: the points of a cell are far apart in memory.
  struct Point {
    Eigen::Vector3d position, normal;
    std::int64_t next; ///< in the same cell
  };
  struct Slot {
    std::uint64_t key;
    std::int64_t first; ///< of the cell's list, -1: the slot is empty
  };

  Cell cellOf(const Eigen::Vector3d& position) const;
  static std::uint64_t keyOf(const Cell& cell);
  std::size_t slotOf(std::uint64_t key) const;
  std::int64_t firstIn(const Cell& cell) const { return slots_[slotOf(keyOf(cell))].first; }
  void grow();

  double side_;
  std::vector<Point> points_;
  std::vector<Slot> slots_; ///< a power of two of them
  std::size_t used_ = 0;
  Cell lower_ = Cell::Zero(), upper_ = Cell::Zero(); ///< of the cells in use
};

} // namespace scan
} // namespace mrf
} // namespace pcl
