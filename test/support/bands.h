// SPDX-License-Identifier: BSD-3-Clause
/// Fields stored in voxels of several sizes.
#pragma once

#include "field/field_contents.h"
#include "field/grid_transfer.h"
#include "support/shapes.h"

#include <memory>
#include <random>
#include <vector>

namespace bands {

/// A band with some voxels of a lattice. \param isStored, value functions of the position of a voxel
template <typename IsStored, typename Value>
std::shared_ptr<pcl::mrf::BandedDistances> bandOn(const pcl::mrf::Lattice& lattice, const IsStored& isStored,
                                                  const Value& value, pcl::mrf::DistanceField background)
{
  using namespace pcl::mrf;
  Execution execution(1);
  auto banded = std::make_shared<BandedDistances>();
  banded->background = std::move(background);
  const auto positionOf = [&](int x, int y, int z) {
    return lattice.position(x - gridMargin, y - gridMargin, z - gridMargin);
  };
  const GridSize grid = withMargin(lattice.size);
  banded->band = VoxelSet(grid, execution, [&](int z, MaskPlane& mask) {
    for (int y = 0; y < grid.y; ++y)
      for (int x = 0; x < grid.x; ++x)
        if (isStored(positionOf(x, y, z)))
          mask.set(x, y);
  });
  shapes::forVoxels(grid, [&](int x, int y, int z) {
    if (banded->band.contains(x, y, z))
      banded->values.push_back(value(positionOf(x, y, z)));
  });
  return banded;
}

/// A field over 32³ voxels of side 1 from the origin on. The voxels have side 4 and 2 outside of two random nested
/// boxes; each band lies within the coarser ones. \param value function of a position
template <typename Value>
pcl::mrf::DistanceField nested(std::mt19937& random, const Value& value)
{
  using namespace pcl::mrf;
  std::uniform_int_distribution<int> low(6, 14), high(16, 26);
  DistanceField field({{4, 4, 4}, {3.5, 3.5, 3.5}, 8}, std::vector<float>(64, 1), {});
  Eigen::Array3f lower = Eigen::Array3f::Constant(-100), upper = Eigen::Array3f::Constant(100);
  for (const int side : {4, 2, 1}) {
    const Lattice lattice{
        {32 / side, 32 / side, 32 / side}, Eigen::Vector3d::Constant(.5 * (side - 1)), static_cast<double>(side)};
    const auto isStored = [&](const Eigen::Vector3f& x) {
      return (x.array() >= lower).all() && (x.array() <= upper).all();
    };
    field = DistanceField(lattice, bandOn(lattice, isStored, value, std::move(field)));
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = std::max(lower[axis], static_cast<float>(low(random)));
      upper[axis] = std::min(upper[axis], static_cast<float>(high(random)));
    }
  }
  return field;
}

} // namespace bands
