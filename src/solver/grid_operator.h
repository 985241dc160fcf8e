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

/// Number of voxels below which waking threads takes longer than they save.
constexpr std::int64_t serialVoxels = 100000;

/// One grid of a hierarchy: its unknowns, and what is observed there.
struct SolverGrid {
  VoxelSet voxels;
  std::unique_ptr<GridData> data;
  Refinement refinement; ///< of the next coarser grid into this one
  /// True if the field itself ends where the grid does. In a narrow band only the correction of the field does.
  bool isWhole = false;
};

/// A ring of windows for consecutive planes. In each window all voxels outside the runs of its plane are zero.
class WindowRing {
public:
  void reset(const VoxelSet& voxels, int planes);

  float* operator[](int z) { return values_.data() + slot(z) * voxels_->windowCount(); }

  /// A window for a plane that is new to the ring; it is zero.
  float* enter(int z);

  /// The same where the caller is going to set all runs of the plane: there the window need not be zero.
  float* enterToOverwrite(int z);

  void clear();

private:
  std::size_t slot(int z) const { return static_cast<std::size_t>((z + 1000 * planes_) % planes_); }

  const VoxelSet* voxels_ = nullptr;
  int planes_ = 0;
  ZeroedFloats values_;
  std::vector<int> held_;
};

/// The memory that a thread keeps from sweep to sweep.
struct SweepScratch {
  WindowRing iterate;
  std::vector<std::vector<WindowRing>> powers; ///< per product: L x, L² x …
  std::vector<WindowRing> products;
  PackedValues directions;
  TransferScratch transfer;
};

/// One sweep over a grid, in one wavefront: steps [first, last] of the Chebyshev polynomial, then a product if it is
/// set.
struct Sweep {
  enum class Source { zero, packed, corrected };
  Source source = Source::packed;
  int first = 1, last = 0;
  const float* b = nullptr;               ///< needed for steps and for a residual
  const float* x = nullptr;               ///< iterate at the start
  const float* coarse = nullptr;          ///< correction of x on the coarser grid, with Source::corrected
  const VoxelSet* coarseVoxels = nullptr; ///< voxels of the correction
  const float* directionIn = nullptr;     ///< direction of step first − 1
  float* out = nullptr;                   ///< iterate at the end
  float* directionOut = nullptr;          ///< direction of step last
  float* product = nullptr;               ///< set to b − A x, or to A x if b is null
  bool isForCoarser = false;              ///< true if the product goes to restrictTo
};

/// Sets b, packed: \see GridData::addRightHandSide
void sumRightHandSide(const SolverGrid& grid, const NormalDraws* draws, PackedValues& b, Execution& execution);

/// A = P + C on a grid, P = L^k with the Laplacian L of the grid's own graph: missing neighbors are dropped.
///
/// The smoother is a Chebyshev polynomial of the 4th kind in D⁻¹A, D = 12^k + the row sums of |C|, so that no
/// eigenvalue exceeds 1: z₁ = 4/3 D⁻¹r, z_i = (2i−3)/(2i+1) z_{i−1} + (8i−4)/(2i+1) D⁻¹r_i. All steps are taken in one
/// sweep over the memory, or in several if the planes of one would not fit into the cache.
///
/// Coarse values are interpolated with (¾, ¼) along each axis. Around a whole level, where coarse voxels are missing,
/// the others share the whole weight; in a band missing ones count as zero.
class GridOperator {
public:
  /// \param tautness wave number, radians per voxel side, below which a correction in a band spreads like a membrane
  /// \pre the grid outlives the operator
  GridOperator(const SolverGrid& grid, const PriorConstants& prior, double tautness, Execution& execution);

  const VoxelSet& voxels() const { return grid_.voxels; }
  bool isObserved(std::int64_t voxel) const { return inverseD_[voxel] < unobserved_; }

  /// Prepares the transfers from and to the next coarser grid.
  void connect(const VoxelSet& coarse, Execution& execution);

  /// Takes `degree` steps of the smoother. \param sweep its start and its outputs; steps and directions are set here
  void smooth(Sweep sweep, int degree, std::vector<SweepScratch>& scratch, Execution& execution);

  /// out = b − A x, or A x if b is null. \param support of x: voxels() itself, or a superset: then L is the lattice's
  void multiply(const VoxelSet& support, const float* x, const float* b, float* out, std::vector<SweepScratch>& scratch,
                Execution& execution);

  /// out = the scaled restriction of `fine`. \param fine product of a sweep with isForCoarser
  void restrictTo(const float* fine, const VoxelSet& coarse, float* out, std::vector<SweepScratch>& scratch,
                  Execution& execution) const;

  /// Bytes of the windows of all threads, and of the vectors between sweeps if smoothing takes more than one.
  /// \param size of the grid \param unknowns number of its unknowns
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
  PackedValues shares_;                    ///< on whole levels: 1 / sum of the weights of the coarse voxels there are
  PackedValues iterate_;                   ///< between sweeps, if smoothing takes more than one
  std::array<PackedValues, 2> directions_; ///< likewise
};

} // namespace pcl::mrf
