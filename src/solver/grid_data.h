// SPDX-License-Identifier: BSD-3-Clause
/// The observations on a band: points, by layers of cells, or weights of voxels.
#pragma once

#include "base/random.h"
#include "field/grid_transfer.h"
#include "field/voxel_set.h"
#include "observation/point_observation.h"

#include <memory>
#include <vector>

namespace pcl::mrf {

/// C and b of the system (P + C) d = b on a band, as sums over layers: layer z couples the planes z and z + 1.
class GridData {
public:
  virtual ~GridData() = default;

  /// Adds C x of layer z to the windows of the planes z and z + 1. Called concurrently.
  virtual void addProduct(int z, const float* x, const float* xAbove, float* y, float* yAbove) const = 0;

  /// Adds upper bounds of the sum of |C_ij| over each row, the share of layer z.
  virtual void addRowSums(int z, float* y, float* yAbove) const = 0;

  /// Adds the share of layer z in b. \param draws null, or b is a draw from N(0, C): that of a field that is zero,
  /// observed with random errors
  virtual void addRightHandSide(int z, const NormalDraws* draws, float* y, float* yAbove) const = 0;

  /// True if C has no entry off its diagonal.
  virtual bool isDiagonal() const = 0;
};

/// The data of points. \param samples, voxels have to exist as long as the result \param unit voxel side in the unit of
/// the field \param isWhole store one matrix per occupied cell even if that takes more memory than the samples; else
/// they are then applied one by one
/// \pre the samples are ordered by cells, and `voxels` has all voxels of these cells
std::unique_ptr<GridData> makePointData(const std::vector<PointSample>& samples, const VoxelSet& voxels,
                                        const PointWeights& weights, double unit, bool isWhole);

/// The voxels whose cells hold a sample.
VoxelSet observedVoxels(const std::vector<PointSample>& samples, const GridSize& grid, Execution& execution);

/// The data of observed voxels. \param weights, targets packed; empty targets: all are 0
std::unique_ptr<GridData> makeVoxelData(const VoxelSet& voxels, std::vector<float> weights, std::vector<float> targets);

} // namespace pcl::mrf
