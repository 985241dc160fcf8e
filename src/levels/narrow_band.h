// SPDX-License-Identifier: BSD-3-Clause
/// The finer levels of the multiscale scheme: bands around the zero level that the coarser one predicts.
#pragma once

#include "field/field_contents.h"
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
  VoxelSet left; ///< former unknowns that no finer level is to resolve; mostly of no grid
};

/// The field of a dense level in the form of a band, continued beyond its border. \param observed on its bands' grid
LevelField fieldOfDense(const Lattice& lattice, const std::vector<float>& values, VoxelSet observed,
                        Execution& execution);

/// Removes from the unknowns, as the next level sees them, what is neither near a surface nor near an observed voxel.
/// \param surface voxels at it
void keepNear(const VoxelSet& surface, LevelField& field, Execution& execution);

/// Removes from a part that finer levels leave out what is not near a surface. \param surface voxels at it
void keepNear(const VoxelSet& surface, BandedDistances& field, Execution& execution);

/// Removes from the unknowns what is not near the wanted voxels, if that is much: finer levels leave it as it is.
/// \param wanted voxels that finer levels are to resolve
/// \return the field at the surface of the removed part, with a few voxels around it; null if nothing is removed
std::shared_ptr<BandedDistances> leaveFarFrom(const VoxelSet& wanted, LevelField& field, Execution& execution);

/// The union of two sets on one grid.
VoxelSet united(const VoxelSet& a, const VoxelSet& b, Execution& execution);

/// The voxels of an observation on the bands' grid. \param voxels indices on the lattice, ascending
VoxelSet voxelSetOf(const std::vector<std::int64_t>& voxels, const GridSize& lattice, const GridSize& grid,
                    Execution& execution);

/// Max number of times that a band is solved, each time grown because the solution left the prediction.
constexpr int maxBandRounds = 3;

/// The voxels at the zero level of a solution that are next to observed voxels, on the planes [begin, end).
VoxelSet zeroLevelAtData(const LevelField& field, int begin, int end, Execution& execution);

/// How much of a zero level close to observed voxels touches the rim of the unknowns.
struct RimCounts {
  std::int64_t zeroLevel = 0; ///< number of voxels at the zero level
  std::int64_t touching = 0;  ///< number of these with a neighbor that is no unknown

  /// True if the zero level continues beyond the unknowns: the coarser level has missed a sheet.
  bool missSheet() const;
};

/// \param zeroLevel that of zeroLevelAtData(): far from data a sheet may end at the rim
RimCounts rimCounts(const VoxelSet& unknowns, const VoxelSet& zeroLevel, Execution& execution);

/// A tile of a level: its grids end where it is cut, and some of their planes are its own.
struct BandTile {
  bool isCutBelow = false, isCutAbove = false; ///< at the first and last plane; surfaces continue beyond a cut
  VoxelSet found;                              ///< the zero level that former rounds have found
  TileStep step;                               ///< of its own planes
};

/// A level to be solved in a band.
struct BandLevel {
  const std::vector<Lattice>& lattices; ///< of all levels
  std::size_t level;                    ///< ≥ 1
  const LevelObservation& observation;
  Prior prior;
  BandTile* tile = nullptr; ///< null: the lattices are those of whole levels
  bool isFirst = false;     ///< the level before is solved everywhere

  bool isFinest() const { return level + 1 == lattices.size(); }
};

/// The interpolation of a coarser field on some voxels of the next lattice, packed.
PackedValues interpolated(const LevelField& coarse, const Lattice& lattice, const VoxelSet& fine, Execution& execution);

/// The interpolation of a coarser field plus a change at the unknowns, which is continued to the support around them.
/// \param change per unknown \param reach of the support around the unknowns, voxels
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
