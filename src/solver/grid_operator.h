// SPDX-License-Identifier: BSD-3-Clause
/// The operator P + C on one grid: products, Chebyshev smoothing, and the transfers to the next coarser grid.
#pragma once

#include "base/arrays.h"
#include "field/grid_transfer.h"
#include "field/prior.h"
#include "field/voxel_set.h"
#include "solver/grid_data.h"

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

namespace pcl::mrf {

/// Voxels below which the overhead of waking threads exceeds what they gain.
constexpr std::int64_t serialVoxels = 100000;

/// One grid of a hierarchy: its unknowns, and what is observed there.
struct SolverGrid {
  VoxelSet voxels;
  std::unique_ptr<GridData> data;
  Refinement refinement; ///< of the next coarser grid into this one
  /// The field itself ends where the grid does. In a narrow band only its correction does.
  bool isWhole = false;
};

/// Windows of consecutive planes; what is not in a run of the plane that a slot holds is zero.
class WindowRing {
public:
  void reset(const VoxelSet& voxels, int planes);

  float* operator[](int z) { return values_.data() + slot(z) * voxels_->windowCount(); }

  /// The window for a plane that is new to the ring, zero.
  float* enter(int z);

  /// The same for a plane whose runs are all going to be set: not zero there.
  float* enterToOverwrite(int z);

  void clear();

private:
  std::size_t slot(int z) const { return static_cast<std::size_t>((z + 1000 * planes_) % planes_); }

  const VoxelSet* voxels_ = nullptr;
  int planes_ = 0;
  ZeroedFloats values_;
  std::vector<int> held_;
};

/// What a thread keeps from sweep to sweep.
struct SweepScratch {
  WindowRing iterate;
  std::vector<std::vector<WindowRing>> powers; ///< per product: L x, L² x …
  std::vector<WindowRing> products;
  PackedValues directions;
  TransferScratch transfer;
};

/// One sweep over a grid: steps [first, last] of the Chebyshev polynomial, all in one wavefront, and a product with the
/// system behind them.
struct Sweep {
  enum class Source { zero, packed, corrected };
  Source source = Source::packed;
  int first = 1, last = 0;
  const float* b = nullptr;               ///< with steps, or for a residual
  const float* x = nullptr;               ///< iterate at the start
  const float* coarse = nullptr;          ///< its correction, with Source::corrected
  const VoxelSet* coarseVoxels = nullptr; ///< of the correction
  const float* directionIn = nullptr;     ///< of step first − 1
  float* out = nullptr;
  float* directionOut = nullptr;
  float* product = nullptr;  ///< b − A x, or A x without b
  bool isForCoarser = false; ///< the product goes to restrictTo
};

/// Sums up a draw from N(0, C) of a grid's data, packed.
void drawOfData(const SolverGrid& grid, const NormalDraws& draws, PackedValues& result, Execution& execution);

/// A = P + C on a grid, P = L^k of the grid's own graph: missing neighbors are dropped.
///
/// The smoother is a Chebyshev polynomial of the 4th kind in D⁻¹A, D = 12^k + the row sums of |C|, so that no
/// eigenvalue exceeds 1: z₁ = 4/3 D⁻¹r, z_i = (2i−3)/(2i+1) z_{i−1} + (8i−4)/(2i+1) D⁻¹r_i. All steps go over the
/// memory in one sweep, or in several if that many planes in flight would not fit into the cache.
///
/// From grid to grid (¾, ¼) interpolates along each axis. Where coarse voxels are missing around a whole level, those
/// that are there share the whole weight; in a band they count as zero.
class GridOperator {
public:
  /// \param tautness wave number, per voxel, below which a correction in a band is a membrane
  /// \pre the grid outlives the operator
  GridOperator(const SolverGrid& grid, const PriorConstants& prior, double tautness, Execution& execution);

  const VoxelSet& voxels() const { return grid_.voxels; }
  bool isObserved(std::int64_t voxel) const { return inverseD_[voxel] < unobserved_; }

  void rightHandSide(PackedValues& b, Execution& execution) const;

  /// Prepares the transfers from and to the next coarser grid.
  void connect(const VoxelSet& coarse, Execution& execution);

  /// `degree` steps of the smoother, from where the sweep starts to where it ends.
  void smooth(Sweep sweep, int degree, std::vector<SweepScratch>& scratch, Execution& execution);

  /// out = b − A x, or A x without b. \param support of x: the grid's voxels, or more: then L^k is that of the lattice
  void multiply(const VoxelSet& support, const float* x, const float* b, float* out, std::vector<SweepScratch>& scratch,
                Execution& execution);

  /// coarse = scale Pᵀ fine. \param fine the product of a sweep for it
  void restrictTo(const float* fine, const VoxelSet& coarse, float* out, std::vector<SweepScratch>& scratch,
                  Execution& execution) const;

  /// Bytes of the windows that threads sweep with, and of what is kept between sweeps where one does not do.
  /// \param size of the grid \param unknowns on it
  static double sweepBytes(const GridSize& size, double unknowns, int order, int degree, int threads);

private:
  class SlabPass;

  int slabsFor(std::size_t threads) const;
  void run(const Sweep& sweep, const VoxelSet& support, std::vector<SweepScratch>& scratch, Execution& execution) const;

  const SolverGrid& grid_;
  PriorConstants prior_;
  float tension_; ///< weight of L beside L^k
  float unobserved_ = 0;
  PackedValues inverseD_;
  PackedValues degrees_;                   ///< empty: six neighbors everywhere
  PackedValues shares_;                    ///< of whole levels: 1 over what there is of the weights of coarse voxels
  PackedValues iterate_;                   ///< between sweeps, where one does not do
  std::array<PackedValues, 2> directions_; ///< likewise
};

} // namespace pcl::mrf
