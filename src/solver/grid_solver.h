// SPDX-License-Identifier: BSD-3-Clause
/// Multigrid-preconditioned conjugate gradients, on a whole level or for the correction of a field in a band.
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

/// Max steps of conjugate gradients on a level that is solved everywhere.
constexpr int wholeLevelSteps = 100;

/// StepLimits::residualOfChange on whole levels. On dense scans the residual is below it before the change is small.
constexpr double residualOfChange = .05;

/// A band counts as converged if its SolveReport::remainingChange is at most this many voxel sides.
constexpr double changeLeftInBands = .1;

/// The smoother's degree: the option, or the prior's.
int smootherDegree(const SolverOptions& options, Prior prior, bool isWhole);

/// The last step of conjugate gradients on a tile of a level. The step of the whole level would have the length
/// Σ decrease / Σ curvature, summed over all tiles.
struct TileStep {
  int begin = 0, end = 0;             ///< the tile's own planes of its grid
  double decrease = 0, curvature = 0; ///< rᵀz and pᵀA p over these planes
  double length = 0;                  ///< of the step taken, by all planes of the tile's grid; 0: no step was taken
};

/// A system to be solved on grids.
struct GridSystem {
  const std::vector<SolverGrid>& grids; ///< finest first; the coarser ones make the preconditioner
  Prior prior;
  const VoxelSet& support;                     ///< voxels of the finest grid; in a band with k more on all sides
  const PackedValues* rightHandSide = nullptr; ///< b, packed; null: that of the data
  TileStep* tile = nullptr;                    ///< set to each step if the grids are those of a tile; else null
};

/// Solves (P + C) d = b on the finest grid. In a narrow band d is corrected so that this holds in the band; the values
/// around it are kept.
///
/// The correction solves (L_B^k + C) e = b − (L^k + C) d, L_B being the Laplacian of the band's own graph, missing
/// neighbors dropped: a change of the surface continues across the band, as it would in the whole space.
/// \param values on the support; in: the guess, out: the solution \param unit length of a voxel side in the unit of the
/// field \throw SolverFailure if values are not finite
SolveReport solveOnGrids(const GridSystem& system, const LevelPlan& plan, const SolverOptions& options, double unit,
                         float* values, Execution& execution);

/// Solves a level everywhere, in at most wholeLevelSteps. \param grids whole, finest first
/// \param unit length of a voxel side in the unit of the field
/// \param values one per voxel of the lattice; in: the guess, out: the solution
/// \throw SolverFailure if values are not finite
SolveReport solveWholeGrids(const std::vector<SolverGrid>& grids, Prior prior, const SolverOptions& options,
                            double unit, std::vector<float>& values, Execution& execution);

} // namespace pcl::mrf
