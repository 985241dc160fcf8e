// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The four solvers of one linear system (paper Sec. 3.4): what they are told, and what they report.
#pragma once

#include <pcl/surface/mrf/export.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

enum class SolverMethod {
  multigrid, ///< conjugate gradients preconditioned by one multigrid V-cycle; see grid_solver.h
  icm,       ///< the paper's iterated conditional modes; see icm.h
  cg,        ///< Fletcher–Reeves conjugate gradients on the energy; see conjugate_gradients.h
  cholesky   ///< sparse Cholesky factorization in double precision, the reference; see cholesky.h
};

struct SolverOptions {
  SolverMethod method = SolverMethod::multigrid;
  int maxIterations = 0;           ///< iterations or sweeps, ≥ 0; 0 = 100 (multigrid; on levels in bands 4, 2, 1),
                                   ///< 1000 (icm), 10000 (cg)
  double residualTolerance = 1e-6; ///< multigrid and cg stop at ‖b − A d‖ ≤ this · ‖b‖, (0, 1)
  double changeTolerance = 5e-4;   ///< icm and multigrid also stop when a step changes d by less, RMS in voxel sides
                                 ///< (icm: over all voxels; multigrid: over the observed ones near the zero level, and
                                 ///< by 4 times as much where points are observed); 0 = never
  int smootherDegree = 0; ///< Chebyshev degree before and after in the V-cycle, 0..50; 0 = 2 / 5 / 10 for k = 1 / 2 /
                          ///< 3, on levels in bands 2 / 4 / 5
  bool choleskyOnCoarsest =
      false;              ///< factorize the coarsest level of the multiscale scheme whatever the method (the paper's)
  std::uint64_t seed = 1; ///< of icm's visiting order, and of the draws of UncertaintyOptions
  std::size_t maxFactorBytes = std::size_t{4} << 30; ///< cholesky refuses when its factor is predicted to be larger
};

/// \throw InvalidOption naming the first field that is out of range
PCL_MRF_EXPORT void validate(const SolverOptions& options);

/// What a solve did.
struct SolveReport {
  SolverMethod method = SolverMethod::multigrid;
  int iterations = 0;          ///< iterations or sweeps; 1 for cholesky
  double relativeResidual = 0; ///< ‖b − A d‖ / ‖b‖ at the end
  /// Multigrid: what more steps would still change at observed voxels near the zero level, RMS in voxel sides, as the
  /// last step and the fall of the residual foretell.
  double remainingChange = 0;
  double remainingChangeOfFillings = 0; ///< the same of voxels near the zero level where nothing is observed
  /// The tolerance of the method is met; on levels in bands, which take a fixed number of steps: remainingChange ≤ .1.
  bool converged = false;
  std::vector<double>
      history; ///< per iteration: relative residual (multigrid, cg), energy per voxel (icm); empty for cholesky
};

} // namespace mrf
} // namespace pcl
