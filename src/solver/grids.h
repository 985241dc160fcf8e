// SPDX-License-Identifier: BSD-3-Clause
/// The grids of a level's solver: the level's own and the coarser ones of its preconditioner; and a cloud on a lattice
/// that is solved everywhere, as pilot runs and draws are.
#pragma once

#include "observation/observation.h"
#include "observation/point_observation.h"
#include "solver/grid_operator.h"

#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/report.h>

#include <vector>

namespace pcl::mrf {

/// The points as each of the nested lattices sees them, coarsest first, by layers of cells.
struct LevelSamples {
  /// On all but the finest one per cell, which is what a level's interpolant can tell apart.
  std::vector<std::vector<PointSample>> own;
  /// One per half of a cell, for the grids of the finer levels' solvers; empty for the finest.
  std::vector<std::vector<PointSample>> beneath;

  LevelSamples() = default;

  /// \param finest by cells
  LevelSamples(std::vector<PointSample> finest, const std::vector<Lattice>& lattices, Execution& execution);

  /// All but those of the finest of at least two lattices. \param seen on the finest
  static LevelSamples beneathFinest(const PointsOnLattice& seen, const std::vector<Lattice>& lattices,
                                    Execution& execution);
};

/// What a level observes: samples at points, or voxels.
struct LevelObservation {
  const LevelSamples* samples = nullptr; ///< of all lattices
  PointWeights weights;                  ///< of this level
  Observation voxels;                    ///< if there are no samples
  PriorOptions prior;                    ///< what weighs the voxels
};

/// Coarsens the coarsest of nested lattices again and again, until its system is a handful of voxels.
/// \param lattices coarsest first \return how many were put before them
std::size_t addCoarserGrids(std::vector<Lattice>& lattices);

/// All voxels of a lattice, on its grid with margin.
VoxelSet wholeOf(const Lattice& lattice, Execution& execution);

/// A level that is solved everywhere, and all grids beneath it.
/// \param lattices coarsest first \param level of them
std::vector<SolverGrid> wholeGrids(const std::vector<Lattice>& lattices, std::size_t level,
                                   const LevelObservation& observation, Prior prior, Execution& execution);

/// A level of which some voxels are unknowns, and some grids beneath it. \param coarseGrids how many at most
std::vector<SolverGrid> bandGrids(const std::vector<Lattice>& lattices, std::size_t level, VoxelSet unknowns,
                                  const LevelObservation& observation, Prior prior, std::size_t coarseGrids,
                                  Execution& execution);

/// Points on a lattice that is solved everywhere, with all grids beneath it.
class WholeLevel {
public:
  /// \param lattices nested, coarsest first: that of the level, after any coarser ones that are given
  /// \param samples of the last of them, in any order
  WholeLevel(std::vector<Lattice> lattices, const std::vector<PointSample>& samples, const PointWeights& weights,
             Prior prior, Execution& execution);
  WholeLevel(const WholeLevel&) = delete;
  WholeLevel& operator=(const WholeLevel&) = delete;

  const Lattice& lattice() const { return lattices_.back(); }
  Prior prior() const { return prior_; }
  const PointWeights& weights() const { return observation_.weights; }
  const std::vector<SolverGrid>& grids() const { return grids_; } ///< finest first

  /// \param values one per voxel, cloud's unit; in: the guess, out: the solution
  /// \throw SolverFailure, Cancelled
  SolveReport solve(const SolverOptions& options, std::vector<float>& values, Execution& execution) const;

private:
  Prior prior_;
  std::vector<Lattice> lattices_;
  LevelSamples samples_;
  LevelObservation observation_;
  std::vector<SolverGrid> grids_; ///< refer to the samples
};

/// A solver for a few digits on a small grid. \param tolerance SolverOptions::changeTolerance
SolverOptions roughSolver(Prior prior, double tolerance);

} // namespace pcl::mrf
