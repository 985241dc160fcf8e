// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The finer levels of the multiscale scheme: bands around the zero level that the coarser one predicts.
#pragma once

#include "observation/observation.h"
#include "solver/grid_solver.h"
#include "solver/grids.h"

#include <pcl/surface/mrf/report.h>

#include <vector>

namespace pcl {
namespace mrf {

/// The field of one level, as the next finer one needs it.
struct LevelField {
  Lattice lattice;
  VoxelSet unknowns;   ///< voxels that were solved for
  VoxelSet support;    ///< voxels with a value: the unknowns and what the next level's interpolation reaches
  PackedValues values; ///< on the support
  VoxelSet observed;
};

/// A dense level as the coarsest of the bands; it is continued beyond its border. \param observed on its bands' grid
LevelField fieldOfDense(const Lattice& lattice, const std::vector<float>& values, VoxelSet observed,
                        Execution& execution);

/// Drops what is neither near a surface nor near an observed voxel from the unknowns, as the next level sees them.
/// \param surface voxels at it
void keepNear(const VoxelSet& surface, LevelField& field, Execution& execution);

/// The voxels of an observation on the bands' grid.
VoxelSet voxelSetOf(const std::vector<std::int64_t>& voxels, const GridSize& lattice, const GridSize& grid,
                    Execution& execution);

/// One level of several.
struct BandLevel {
  const std::vector<Lattice>& lattices; ///< of all levels
  std::size_t level;                    ///< ≥ 1
  const LevelObservation& observation;
  Prior prior;

  bool isFinest() const { return level + 1 == lattices.size(); }
};

/// Solves one level in a band.
///
/// Unknowns are the observed voxels and those within two voxels of the interpolated zero level, six where nothing is
/// observed near and finer levels follow. Where the coarser level has missed a sheet that is observed, the band grows
/// and is solved again.
/// \param coarse the field of the level before
LevelField solveNarrowBand(const BandLevel& own, const LevelField& coarse, const LevelPlan& plan,
                           const SolverOptions& solver, LevelReport& report, Execution& execution);

} // namespace mrf
} // namespace pcl
