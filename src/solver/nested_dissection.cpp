// SPDX-License-Identifier: BSD-3-Clause
#include "solver/nested_dissection.h"

namespace pcl::mrf {
namespace {

/// Boxes of at most this many voxels are not cut any further.
constexpr std::int64_t voxelsOfLeaf = 64;

void dissect(const VoxelBox& box, const Coupling& coupling, const std::function<void(const Front&)>& visit)
{
  std::size_t longest = 0;
  for (const std::size_t axis : {1u, 2u})
    if (box.side(axis) > box.side(longest))
      longest = axis;
  if (box.count() <= voxelsOfLeaf || box.side(longest) < coupling.steps + 2) {
    visit({box, box});
    return;
  }
  VoxelBox lower = box, separator = box, upper = box;
  lower.upper[longest] = separator.lower[longest] = box.lower[longest] + (box.side(longest) - coupling.steps) / 2;
  separator.upper[longest] = upper.lower[longest] = separator.lower[longest] + coupling.steps;
  dissect(lower, coupling, visit);
  dissect(upper, coupling, visit);
  visit({separator, box});
}

/// The number of voxels outside a front's region that are coupled with it. All of them are eliminated later, and
/// eliminating the region couples them with each other.
std::int64_t boundaryCount(const Front& front, const GridSize& size, const Coupling& coupling)
{
  const std::array<int, 3> sides{size.x, size.y, size.z};
  // The number of coordinates along an axis that are at a distance from the region.
  const auto number = [&](std::size_t axis, int distance) {
    if (distance == 0)
      return front.region.side(axis);
    return (front.region.lower[axis] >= distance ? 1 : 0) +
           (front.region.upper[axis] + distance <= sides[axis] ? 1 : 0);
  };
  std::int64_t count = -front.region.count();
  for (int dz = 0; dz <= coupling.steps; ++dz)
    for (int dy = 0; dy <= coupling.steps; ++dy)
      for (int dx = 0; dx <= coupling.steps; ++dx)
        if (coupling.joins(dx, dy, dz))
          count += std::int64_t{number(0, dx)} * number(1, dy) * number(2, dz);
  return count;
}

} // namespace

void dissect(const GridSize& size, const Coupling& coupling, const std::function<void(const Front&)>& visit)
{
  VoxelBox all;
  all.upper = {size.x, size.y, size.z};
  dissect(all, coupling, visit);
}

std::vector<std::int64_t> dissectionOrder(const GridSize& size, const Coupling& coupling)
{
  std::vector<std::int64_t> voxels;
  voxels.reserve(size.count());
  dissect(size, coupling, [&](const Front& front) {
    const VoxelBox& own = front.own;
    for (int z = own.lower[2]; z < own.upper[2]; ++z)
      for (int y = own.lower[1]; y < own.upper[1]; ++y)
        for (int x = own.lower[0]; x < own.upper[0]; ++x)
          voxels.push_back(size.index(x, y, z));
  });
  return voxels;
}

FactorCost factorCost(const GridSize& size, const Coupling& coupling)
{
  FactorCost cost;
  dissect(size, coupling, [&](const Front& front) {
    const double columns = static_cast<double>(front.own.count()),
                 rows = columns + static_cast<double>(boundaryCount(front, size, coupling));
    cost.bytes += rows * (columns * sizeof(double) + sizeof(std::int32_t));
    // Eliminating column c of a front takes (rows − c)² operations.
    const double last = rows - columns;
    cost.flops += (rows * (rows + 1) * (2 * rows + 1) - last * (last + 1) * (2 * last + 1)) / 6;
  });
  return cost;
}

} // namespace pcl::mrf
