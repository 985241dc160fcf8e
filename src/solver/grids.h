// SPDX-License-Identifier: BSD-3-Clause
/// The grids of a level's solver: the level's own and the coarser ones of its preconditioner; and WholeLevel, points on
/// a lattice that is solved everywhere, for pilot runs and draws.
#pragma once

#include "observation/observation.h"
#include "observation/point_observation.h"
#include "solver/grid_operator.h"

#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/report.h>

#include <vector>

namespace pcl::mrf {

/// The samples of the points on each of the nested lattices, coarsest first, ordered by cells.
struct LevelSamples {
  /// Samples for solving the level itself; on all but the finest one per cell, as its interpolant tells no more apart.
  std::vector<std::vector<PointSample>> own;
  /// Samples for the coarse grids in the solvers of finer levels, one per cube of half a voxel; empty for the finest.
  std::vector<std::vector<PointSample>> beneath;

  LevelSamples() = default;

  /// \param finest samples of the finest lattice, ordered by cells
  LevelSamples(std::vector<PointSample> finest, const std::vector<Lattice>& lattices, Execution& execution);

  /// The samples of all lattices but the finest. \param seen the points on the finest \pre at least two lattices
  static LevelSamples beneathFinest(const PointsOnLattice& seen, const std::vector<Lattice>& lattices,
                                    Execution& execution);
};

/// What a level observes: samples at points, or voxels.
struct LevelObservation {
  const LevelSamples* samples = nullptr; ///< of all lattices; null: voxels are observed
  PointWeights weights;                  ///< of this level
  Observation voxels;                    ///< if there are no samples
  PriorOptions prior;                    ///< its β and order weigh the voxels
};

/// Adds coarser lattices until the coarsest has at most 100 voxels.
/// \param lattices nested, coarsest first \return the number of lattices that were put before them
std::size_t addCoarserGrids(std::vector<Lattice>& lattices);

/// All voxels of a lattice, on its grid with margin.
VoxelSet wholeOf(const Lattice& lattice, Execution& execution);

/// The grids of a level that is solved everywhere: its own and all coarser ones, finest first.
/// \param lattices coarsest first \param level index of its lattice
std::vector<SolverGrid> wholeGrids(const std::vector<Lattice>& lattices, std::size_t level,
                                   const LevelObservation& observation, Prior prior, Execution& execution);

/// The grids of a level in a band: its own with the unknowns, and coarser ones. \param coarseGrids their max number
std::vector<SolverGrid> bandGrids(const std::vector<Lattice>& lattices, std::size_t level, VoxelSet unknowns,
                                  const LevelObservation& observation, Prior prior, std::size_t coarseGrids,
                                  Execution& execution);

/// Points on a lattice that is solved everywhere, with all grids beneath it.
class WholeLevel {
public:
  /// \param lattices nested, coarsest first; the last is the level's, missing coarser ones are added
  /// \param samples on the last of them, in any order
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
  std::vector<SolverGrid> grids_; ///< refer to samples_
};

/// Options for solving a small grid to a few digits. \param tolerance SolverOptions::changeTolerance
SolverOptions roughSolver(Prior prior, double tolerance);

} // namespace pcl::mrf
