// SPDX-License-Identifier: BSD-3-Clause
#include "options/validation.h"
#include "solver/cholesky.h"
#include "solver/conjugate_gradients.h"
#include "solver/icm.h"
#include "solver/linear_system.h"
#include "solver/multigrid.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace pcl {
namespace mrf {
namespace {

void checkSizes(const LinearSystem& system, const std::vector<double>& d)
{
  if (system.data.rows() != system.size().count() || system.rightHandSide.size() != d.size() ||
      d.size() != static_cast<std::size_t>(system.size().count()) || d.empty())
    throw std::invalid_argument("solve: the prior, the data term and the field differ in size");
  const std::size_t weights = system.prior.voxelWeights.size();
  if (weights != 0 && weights != d.size())
    throw std::invalid_argument("solve: voxelWeights must be empty or hold one value per voxel");
}

} // namespace

SolveReport solve(const LinearSystem& system, const SolverOptions& options, double unit, std::vector<double>& d,
                  Execution& execution)
{
  validate(options);
  checkSizes(system, d);
  if (!(unit > 0 && std::isfinite(unit)))
    throw std::invalid_argument("solve: the unit must be positive and finite");
  if (!(system.data.coeffs() > 0).any())
    throw SolverFailure("no voxel is observed with a positive weight, so that the field is not determined; check the "
                        "confidences, and that beta is above 0");

  SolveReport report;
  switch (options.method) {
  case SolverMethod::multigrid:
    report = solveMultigrid(system, options, unit, d, execution);
    break;
  case SolverMethod::icm:
    report = solveIcm(system, options, unit, d, execution);
    break;
  case SolverMethod::cg:
    report = solveConjugateGradients(system, options, d, execution);
    break;
  case SolverMethod::cholesky:
    report = solveCholesky(system, options, d, execution);
    break;
  }
  if (!std::all_of(d.begin(), d.end(), [](double value) { return std::isfinite(value); }))
    throw SolverFailure("the solution is not finite; check the observed distances and the initial guess");
  return report;
}

} // namespace mrf
} // namespace pcl
