// SPDX-License-Identifier: BSD-3-Clause
/// A cloud on one lattice, solved everywhere: what pilot runs and draws are made on.
#pragma once

#include "observation/observation.h"
#include "solver/grids.h"

#include <pcl/surface/mrf/report.h>

#include <vector>

namespace pcl::mrf {

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
