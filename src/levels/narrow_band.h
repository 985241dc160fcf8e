// SPDX-License-Identifier: BSD-3-Clause
/// The finer levels of the multiscale scheme: bands around the zero level that the coarser one predicts.
#pragma once

#include "field/field_contents.h"
#include "observation/observation.h"
#include "solver/grid_solver.h"
#include "solver/grids.h"

#include <pcl/surface/mrf/report.h>

#include <memory>
#include <vector>

namespace pcl::mrf {

/// The field of one level, as the next finer one needs it.
struct LevelField {
  Lattice lattice;
  VoxelSet unknowns;   ///< voxels that were solved for
  VoxelSet support;    ///< voxels with a value: the unknowns and what the next level's interpolation reaches
  PackedValues values; ///< on the support
  VoxelSet observed;
  VoxelSet left; ///< unknowns that no finer level is to resolve, and which are none any more; mostly of no grid
};

/// A dense level as the coarsest of the bands; it is continued beyond its border. \param observed on its bands' grid
LevelField fieldOfDense(const Lattice& lattice, const std::vector<float>& values, VoxelSet observed,
                        Execution& execution);

/// Drops what is neither near a surface nor near an observed voxel from the unknowns, as the next level sees them.
/// \param surface voxels at it
void keepNear(const VoxelSet& surface, LevelField& field, Execution& execution);

/// The same of what is left of a level. \param surface voxels at it
void keepNear(const VoxelSet& surface, BandedDistances& field, Execution& execution);

/// Leaves what is not near some voxels as it is, if that is much: it is no unknown any more for finer levels.
/// \param wanted voxels that finer levels are to resolve
/// \return what holds the rest, and a few voxels around it; nothing if all is kept
std::shared_ptr<BandedDistances> leaveFarFrom(const VoxelSet& wanted, LevelField& field, Execution& execution);

/// The voxels of two sets on one grid.
VoxelSet united(const VoxelSet& a, const VoxelSet& b, Execution& execution);

/// The voxels of an observation on the bands' grid.
VoxelSet voxelSetOf(const std::vector<std::int64_t>& voxels, const GridSize& lattice, const GridSize& grid,
                    Execution& execution);

/// How often a band may grow because the solution left the prediction.
constexpr int maxBandRounds = 3;

/// The zero level of a solution where observed voxels are close, on the planes [begin, end).
VoxelSet zeroLevelAtData(const LevelField& field, int begin, int end, Execution& execution);

/// Where a zero level close to observed voxels meets the rim of the unknowns.
struct RimCounts {
  std::int64_t zeroLevel = 0; ///< voxels at it
  std::int64_t touching = 0;  ///< of them, those with a neighbor that is no unknown

  /// True if the zero level goes on beyond the unknowns: the coarser level has missed a sheet.
  bool missSheet() const;
};

/// \param zeroLevel zeroLevelAtData: far from data sheets end at rims as they please
RimCounts rimCounts(const VoxelSet& unknowns, const VoxelSet& zeroLevel, Execution& execution);

/// A tile of a level: its grids end where it is cut, and some of their planes are its own.
struct BandTile {
  bool isCutBelow = false, isCutAbove = false; ///< across z: what reaches the cut goes on beyond it
  VoxelSet found;                              ///< the zero level that former rounds have found
  TileStep step;                               ///< of its own planes
};

/// One level of several.
struct BandLevel {
  const std::vector<Lattice>& lattices; ///< of all levels
  std::size_t level;                    ///< ≥ 1
  const LevelObservation& observation;
  Prior prior;
  BandTile* tile = nullptr; ///< none: the lattices are the whole levels
  bool isFirst = false;     ///< the level before is solved everywhere

  bool isFinest() const { return level + 1 == lattices.size(); }
};

/// What a level is on the lattice of the next: the coarser field's interpolation on some voxels, packed.
PackedValues interpolated(const LevelField& coarse, const Lattice& lattice, const VoxelSet& fine, Execution& execution);

/// The interpolation of a coarser field, changed at the unknowns, and around them as their neighbors are.
/// \param change per unknown \param reach of the support around them, voxels
LevelField fieldOfChange(const LevelField& coarse, const Lattice& lattice, VoxelSet unknowns,
                         const PackedValues& change, int reach, Execution& execution);

/// Solves one level in a band.
///
/// Unknowns are the observed voxels and those within two voxels of the interpolated zero level; four where the finest
/// level is the only one in a band, six where nothing is observed near and finer levels follow. Where the coarser level
/// has missed a sheet that is observed, the band grows and is solved again; a tile is solved once, with the values
/// around its unknowns left as they were interpolated. \param coarse the field of the level before
LevelField solveNarrowBand(const BandLevel& own, const LevelField& coarse, const LevelPlan& plan,
                           const SolverOptions& solver, LevelReport& report, Execution& execution);

} // namespace pcl::mrf
