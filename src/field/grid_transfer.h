// SPDX-License-Identifier: BSD-3-Clause
/// Transfers between a band and the one on the next coarser lattice.
#pragma once

#include "field/voxel_set.h"

#include <vector>

namespace pcl::mrf {

/// Voxels that the grid of a level's bands has around the level's lattice: where a sheet runs into the border, stencils
/// and interpolation reach beyond it.
constexpr int gridMargin = 4;

/// The size of the bands' grid around a lattice.
inline GridSize withMargin(const GridSize& size)
{
  return {size.x + 2 * gridMargin, size.y + 2 * gridMargin, size.z + 2 * gridMargin};
}

/// Which voxels of a level lie in which voxel of the next coarser level, in the indices of their bands' grids.
struct Refinement {
  Eigen::Array3i parity = Eigen::Array3i::Zero(); ///< per axis: 1 if voxel 0 is the second child of its parent
  int children = 8;                               ///< per voxel: 2 along each axis of more than one voxel

  Refinement() = default;
  Refinement(const Lattice& coarse, const Lattice& fine);

  int parent(int fine, int axis) const { return (fine + gridMargin + parity[axis]) >> 1; }
  bool isSecond(int fine, int axis) const { return ((fine + parity[axis]) & 1) != 0; }
  int firstChild(int coarse, int axis) const { return 2 * coarse - gridMargin - parity[axis]; }
};

/// A window and scratch rows of one thread. The window is zero between uses.
struct TransferScratch {
  std::vector<float> window, rows;
};

/// A band and its packed values.
struct PackedField {
  const VoxelSet& voxels;
  const float* values;
};

/// interpolateCubic from band to band, on plane z of the fine band. Values that the coarse band does not have count as
/// zero: the caller makes sure that none of them is needed. \param out packed values of the plane
void interpolatePlane(const PackedField& coarse, const Refinement& refinement, const VoxelSet& fine, int z, float* out,
                      TransferScratch& scratch);

/// window += P coarse on plane z of the fine band: interpolation with (¾, ¼).
void addProlonged(const PackedField& coarse, const Refinement& refinement, const VoxelSet& fine, int z, float* window,
                  TransferScratch& scratch);

/// coarse = scale · Pᵀ fine on plane z of the coarse band.
void restrictPlane(const PackedField& fine, const Refinement& refinement, float scale, const VoxelSet& coarse, int z,
                   float* out, TransferScratch& scratch);

/// The parents of a band's voxels.
VoxelSet coarsened(const VoxelSet& fine, const GridSize& coarse, const Refinement& refinement, Execution& execution);

} // namespace pcl::mrf
