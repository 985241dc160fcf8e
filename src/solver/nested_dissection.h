// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The order in which a sparse factorization eliminates the voxels of a grid, and what its factor takes.
#pragma once

#include <pcl/surface/mrf/lattice.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace pcl {
namespace mrf {

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
  VoxelBox region; ///< all that is eliminated by then of the part of the grid that `own` belongs to, itself included
};

/// Nested dissection: a slab through the middle of the longest axis, as thick as the coupling reaches, is eliminated
/// after both of the halves that it separates. Calls visit(front) in the order of elimination.
void dissect(const GridSize& size, const Coupling& coupling, const std::function<void(const Front&)>& visit);

/// Calls visit(x, y, z) for the voxels outside of a front's region that it is coupled with: all of them are eliminated
/// later, and after the region they are coupled with each other.
template <typename Visit>
void forEachBoundaryVoxel(const Front& front, const GridSize& size, const Coupling& coupling, const Visit& visit)
{
  const VoxelBox& box = front.region;
  const std::array<int, 3> sides{size.x, size.y, size.z};
  VoxelBox around;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    around.lower[axis] = std::max(box.lower[axis] - coupling.steps, 0);
    around.upper[axis] = std::min(box.upper[axis] + coupling.steps, sides[axis]);
  }
  const auto distance = [&](std::size_t axis, int i) {
    return std::max({box.lower[axis] - i, i - (box.upper[axis] - 1), 0});
  };
  for (int z = around.lower[2]; z < around.upper[2]; ++z)
    for (int y = around.lower[1]; y < around.upper[1]; ++y) {
      const int dy = distance(1, y), dz = distance(2, z);
      for (int x = around.lower[0]; x < around.upper[0]; ++x) {
        if (dy == 0 && dz == 0 && x == box.lower[0])
          x = box.upper[0]; // the region itself
        if (x < around.upper[0] && coupling.joins(distance(0, x), dy, dz))
          visit(x, y, z);
      }
    }
}

/// How many those are.
std::int64_t boundaryCount(const Front& front, const GridSize& size, const Coupling& coupling);

/// What a factor takes.
struct FactorCost {
  double bytes = 0; ///< of its numbers and its indices
  double flops = 0; ///< to compute it
};

/// Known before anything is allocated.
FactorCost factorCost(const GridSize& size, const Coupling& coupling);

} // namespace mrf
} // namespace pcl
