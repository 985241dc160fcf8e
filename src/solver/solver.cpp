// SPDX-License-Identifier: BSD-3-Clause
#include "base/loops.h"
#include "base/vector_kernels.h"
#include "options/validation.h"
#include "solver/cholesky.h"
#include "solver/linear_system.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>

#include <algorithm>
#include <cmath>

namespace pcl::mrf {
SolveReport solveConjugateGradients(const LinearSystem& system, const SolverOptions& options, std::vector<double>& d,
                                    Execution& execution)
{
  SolveReport report;
  report.method = SolverMethod::cg;
  const std::vector<double>& b = system.rightHandSide;
  const int maxIterations = options.maxIterations > 0 ? options.maxIterations : 10000;
  const double norm = std::sqrt(dotProduct(b, b, execution));
  if (norm == 0) {
    std::fill(d.begin(), d.end(), 0.);
    report.converged = true;
    return report;
  }
  const double target = options.residualTolerance * norm;

  // r is the downhill gradient of the energy, p the direction conjugate to all before.
  std::vector<double> r(d.size()), product(d.size());
  double squared = residual(system, d, r, execution);
  double restarted = squared;
  std::vector<double> p = r;
  while (std::sqrt(squared) > target && report.iterations < maxIterations) {
    multiply(system, p, product, execution);
    const double curvature = dotProduct(p, product, execution);
    if (!std::isfinite(curvature) || !std::isfinite(squared))
      throw SolverFailure("cg: the iteration broke down with values that are not finite");
    if (!(curvature > 0))
      break; // nothing but rounding is left
    const double step = squared / curvature;
    forEach(execution, d.size(), sumGrain, [&](std::size_t i) {
      d[i] += step * p[i];
      r[i] -= step * product[i];
    });
    const double next = dotProduct(r, r, execution);
    double beta = next / squared; // Fletcher–Reeves
    squared = next;
    ++report.iterations;
    bool stalled = false;
    if (std::sqrt(squared) <= target) {
      // By rounding r has drifted from the true residual, which is computed here.
      squared = residual(system, d, r, execution);
      stalled = std::sqrt(squared) > target && squared > .25 * restarted;
      restarted = squared;
      beta = 0;
    }
    scaleAndAdd(beta, r, p, execution);
    report.history.push_back(std::sqrt(squared) / norm);
    execution.progress(static_cast<double>(report.iterations) / maxIterations);
    if (stalled)
      break;
  }
  report.relativeResidual = std::sqrt(residual(system, d, r, execution)) / norm;
  report.converged = report.relativeResidual <= options.residualTolerance;
  return report;
}

SolveReport solve(const LinearSystem& system, const SolverOptions& options, double unit, std::vector<double>& d,
                  Execution& execution)
{
  validate(options);
  if (!system.isObserved)
    throw SolverFailure("no voxel is observed with a positive weight, so that the field is not determined; check the "
                        "confidences, and that beta is above 0");

  SolveReport report;
  switch (options.method) {
  case SolverMethod::icm:
  case SolverMethod::icmColors:
    report = solveIcm(system, options, unit, d, execution);
    break;
  case SolverMethod::multigrid:
  case SolverMethod::cg:
    report = solveConjugateGradients(system, options, d, execution);
    break;
  case SolverMethod::cholesky:
    report = solveCholesky(system, d, execution);
    break;
  }
  if (!std::all_of(d.begin(), d.end(), [](double value) { return std::isfinite(value); }))
    throw SolverFailure("the solution is not finite; check the observed distances and the initial guess");
  return report;
}

} // namespace pcl::mrf
