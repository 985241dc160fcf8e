// SPDX-License-Identifier: BSD-3-Clause
/// Multigrid-preconditioned conjugate gradients on a level: whole, or the correction of a field in a band.
#pragma once

#include "solver/grid_operator.h"

#include <pcl/surface/mrf/report.h>

#include <vector>

namespace pcl::mrf {

/// How far a level is solved.
struct LevelPlan {
  int steps;                   ///< of conjugate gradients
  std::size_t coarseGrids = 0; ///< of the preconditioner, beneath the level's own
  int threads = 1;             ///< that may sweep over it at the same time
};

/// Steps before a level that is solved everywhere counts as not to be solved.
constexpr int wholeLevelSteps = 100;

/// StepLimits::residualOfChange on whole levels; on dense scans it is passed before the change is small enough.
constexpr double residualOfChange = .05;

/// SolveReport::remainingChange of a band that counts as converged, voxel sides.
constexpr double changeLeftInBands = .1;

/// The smoother's degree: the option, or the prior's.
int smootherDegree(const SolverOptions& options, Prior prior, bool isWhole);

/// The last step as it looks from some planes of the finest grid, where a level is solved in tiles: a step is as long
/// as the decrease of all planes over the curvature of all.
struct TileStep {
  int begin = 0, end = 0;             ///< planes that count
  double decrease = 0, curvature = 0; ///< rᵀz and pᵀA p over them
  double length = 0;                  ///< of the step that was taken: by all planes that are there; 0: none was
};

/// What is solved on grids.
struct GridSystem {
  const std::vector<SolverGrid>& grids; ///< finest first; the coarser ones make the preconditioner
  Prior prior;
  const VoxelSet& support;                     ///< the finest grid, or in a band a superset by k voxels on all sides
  const PackedValues* rightHandSide = nullptr; ///< b, packed; none: that of the data
  TileStep* tile = nullptr;                    ///< to be set, if the grids are a tile's
};

/// Solves (P + C) d = b on the finest grid; in a narrow band corrects d so that this holds there, while it keeps its
/// values outside.
///
/// The correction solves (L_B^k + C) e = b − (L^k + C) d, L_B being the Laplacian of the band's own graph, missing
/// neighbors dropped: the change of the surface is carried on across the band, as in the whole space.
/// \param values on the support; in: the guess, out: the solution \param unit length of a voxel side in the unit of the
/// field \throw SolverFailure if values are not finite
SolveReport solveOnGrids(const GridSystem& system, const LevelPlan& plan, const SolverOptions& options, double unit,
                         float* values, Execution& execution);

/// Solves a level everywhere, within wholeLevelSteps. \param grids whole, finest first
/// \param unit length of a voxel side in the unit of the field
/// \param values one per voxel of the lattice; in: the guess, out: the solution
/// \throw SolverFailure if values are not finite
SolveReport solveWholeGrids(const std::vector<SolverGrid>& grids, Prior prior, const SolverOptions& options,
                            double unit, std::vector<float>& values, Execution& execution);

} // namespace pcl::mrf
