// SPDX-License-Identifier: BSD-3-Clause
/// The observation models on a band: points by layers of cells, or weights of voxels.
#pragma once

#include "base/random.h"
#include "field/grid_transfer.h"
#include "field/voxel_set.h"
#include "observation/point_observation.h"

#include <memory>
#include <vector>

namespace pcl::mrf {

/// C and b of a system on a band, assembled on the fly from layers: layer z couples the planes z and z + 1.
class GridData {
public:
  virtual ~GridData() = default;

  /// Adds C x of layer z to the windows of the planes z and z + 1. Called concurrently.
  virtual void addProduct(int z, const float* x, const float* xAbove, float* y, float* yAbove) const = 0;

  /// Adds bounds on the sums of |C_ij| over each row.
  virtual void addRowSums(int z, float* y, float* yAbove) const = 0;

  /// Adds b.
  virtual void addRightHandSide(int z, float* y, float* yAbove) const = 0;

  /// Adds a draw from N(0, C): what the observations say of a field that is zero if each of them is off by chance.
  virtual void addDraw(int z, const NormalDraws& draws, float* y, float* yAbove) const = 0;

  /// True if C has no entry off its diagonal.
  virtual bool isDiagonal() const = 0;
};

/// The points as samples of the field, which has to live as long as what is returned.
/// \pre the samples are ordered by cells, and the grid has all voxels of these \param unit of the field, per voxel
/// \param isWhole memory for one matrix per occupied cell does not matter; else samples are taken one by one unless
/// there are many in a cell
std::unique_ptr<GridData> makePointData(const std::vector<PointSample>& samples, const VoxelSet& voxels,
                                        const PointWeights& weights, double unit, bool isWhole);

/// The voxels whose cells hold a sample.
VoxelSet observedVoxels(const std::vector<PointSample>& samples, const GridSize& grid, Execution& execution);

/// Weights and targets of observed voxels. \param weights, targets packed; no targets: 0
std::unique_ptr<GridData> makeVoxelData(const VoxelSet& voxels, std::vector<float> weights, std::vector<float> targets);

} // namespace pcl::mrf
