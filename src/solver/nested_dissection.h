// SPDX-License-Identifier: BSD-3-Clause
/// The order in which a sparse factorization eliminates the voxels of a grid, and the cost of its factor.
#pragma once

#include <pcl/surface/mrf/lattice.h>

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace pcl::mrf {

/// Which voxels a system couples: those at most `steps` edges of the lattice apart, and with `corners` those that share
/// a corner.
struct Coupling {
  int steps = 1; ///< ≥ 1
  bool corners = false;

  /// \param dx, dy, dz distance along the axes, ≥ 0
  bool joins(int dx, int dy, int dz) const
  {
    return dx + dy + dz <= steps || (corners && dx <= 1 && dy <= 1 && dz <= 1);
  }
};

/// Voxels [lower, upper) of a grid.
struct VoxelBox {
  std::array<int, 3> lower{0, 0, 0}, upper{0, 0, 0};

  int side(std::size_t axis) const { return upper[axis] - lower[axis]; }
  std::int64_t count() const { return std::int64_t{side(0)} * side(1) * side(2); }
};

/// Voxels that are eliminated together: a separator, or a box that is small enough.
struct Front {
  VoxelBox own;
  VoxelBox region; ///< the box that `own` divides or is: all of it has been eliminated after `own`
};

/// Nested dissection: a slab through the middle of the longest axis, as thick as the coupling reaches, is eliminated
/// after both of the halves that it separates. Calls visit(front) in the order of elimination.
void dissect(const GridSize& size, const Coupling& coupling, const std::function<void(const Front&)>& visit);

/// The voxels in the order of elimination.
std::vector<std::int64_t> dissectionOrder(const GridSize& size, const Coupling& coupling);

/// The cost of a factor.
struct FactorCost {
  double bytes = 0; ///< of its numbers and its indices
  double flops = 0; ///< to compute it
};

/// Computes the cost of a factor without allocating it.
FactorCost factorCost(const GridSize& size, const Coupling& coupling);

} // namespace pcl::mrf
