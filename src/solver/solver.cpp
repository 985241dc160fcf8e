// SPDX-License-Identifier: BSD-3-Clause
#include "options/validation.h"
#include "solver/cholesky.h"
#include "solver/linear_system.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace pcl::mrf {
namespace {

void checkSizes(const LinearSystem& system, const std::vector<double>& d)
{
  const auto count = static_cast<std::size_t>(system.size.count());
  if (system.matrix.rows() != system.size.count() || system.rightHandSide.size() != count || d.size() != count ||
      count == 0)
    throw std::invalid_argument("solve: the matrix, the right-hand side and the field differ in size");
}

} // namespace

SolveReport solve(const LinearSystem& system, const SolverOptions& options, double unit, std::vector<double>& d,
                  Execution& execution)
{
  validate(options);
  checkSizes(system, d);
  if (!(unit > 0 && std::isfinite(unit)))
    throw std::invalid_argument("solve: the unit must be positive and finite");
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
