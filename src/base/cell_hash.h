// SPDX-License-Identifier: BSD-3-Clause
/// The occupied cells of a uniform grid.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Numbers cells in the order in which they are first added: a hash table with open addressing.
class CellHash {
public:
  using Cell = Eigen::Array<std::int64_t, 3, 1>; ///< 0 ≤ coordinates < end
  static constexpr std::int64_t end = std::int64_t{1} << 21;
  static constexpr std::uint32_t none = ~std::uint32_t{0};

  /// \param origin lower corner of the first cell \param side side of the cells
  CellHash(const Eigen::Vector3d& origin, double side)
      : origin_(origin.array()), side_(side), slots_(64, none), shift_(64 - 6)
  {}

  /// The cell of a position. Positions outside of the grid belong to the nearest cell of its border.
  Cell cellOf(const Eigen::Vector3f& position) const
  {
    const Eigen::Array3d cell = ((position.cast<double>().array() - origin_) / side_).floor();
    return cell.max(0).min(static_cast<double>(end - 1)).cast<std::int64_t>();
  }

  /// The same grid without cells.
  CellHash empty() const { return CellHash(origin_.matrix(), side_); }

  std::size_t size() const { return keys_.size(); }

  Cell operator[](std::size_t number) const
  {
    const std::uint64_t key = keys_[number], mask = end - 1;
    return Cell(key & mask, key >> 21 & mask, key >> 42);
  }

  /// Adds a cell if it is new. \return its number
  std::uint32_t add(const Cell& cell)
  {
    std::uint32_t& number = slots_[slotOf(keyOf(cell))];
    if (number != none)
      return number;
    number = static_cast<std::uint32_t>(keys_.size());
    keys_.push_back(keyOf(cell));
    if (2 * keys_.size() > slots_.size())
      grow();
    return static_cast<std::uint32_t>(keys_.size() - 1);
  }

  /// \return the number of a cell; `none` if it was not added or is outside of the grid
  std::uint32_t find(const Cell& cell) const
  {
    return (cell < 0).any() || (cell >= end).any() ? none : slots_[slotOf(keyOf(cell))];
  }

  /// Calls visit(cell) for a cell and its 26 neighbors, ascending along z, then y, then x.
  template <typename Visit>
  static void forEachAround(const Cell& cell, const Visit& visit)
  {
    for (std::int64_t n = 0; n < 27; ++n)
      visit(Cell(cell + Cell(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)));
  }

private:
  static std::uint64_t keyOf(const Cell& cell)
  {
    return static_cast<std::uint64_t>(cell.x() | cell.y() << 21 | cell.z() << 42);
  }

  std::size_t slotOf(std::uint64_t key) const
  {
    const std::size_t mask = slots_.size() - 1;
    std::size_t slot = key * 0x9e3779b97f4a7c15u >> shift_; // all coordinates influence the uppermost bits
    while (slots_[slot] != none && keys_[slots_[slot]] != key)
      slot = (slot + 1) & mask;
    return slot;
  }

  void grow()
  {
    slots_.assign(2 * slots_.size(), none);
    --shift_;
    for (std::uint32_t n = 0; n < keys_.size(); ++n)
      slots_[slotOf(keys_[n])] = n;
  }

  Eigen::Array3d origin_;
  double side_;
  std::vector<std::uint32_t> slots_; ///< numbers by hashed key; 2^(64 − shift_) of them
  int shift_;
  std::vector<std::uint64_t> keys_; ///< by number
};

} // namespace pcl::mrf
