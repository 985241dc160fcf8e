// SPDX-License-Identifier: BSD-3-Clause
#include "cholesky.h"
#include "conjugate_gradients.h"
#include "icm.h"
#include "linear_system.h"
#include "multigrid.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace pcl {
namespace mrf {
namespace {

template <typename Value>
[[noreturn]] void refuse(const char* name, const Value& value, const char* range)
{
  std::ostringstream message;
  message << name << " is " << value << "; it must be " << range;
  throw InvalidOption(message.str());
}

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

void validate(const SolverOptions& options)
{
  const int method = static_cast<int>(options.method);
  if (method < 0 || method > static_cast<int>(SolverMethod::cholesky))
    refuse("solver method", method, "multigrid, icm, cg or cholesky");
  if (options.maxIterations < 0)
    refuse("maxIterations", options.maxIterations, "at least 0 (0 = the method's default)");
  if (!(options.residualTolerance > 0 && options.residualTolerance < 1))
    refuse("residualTolerance", options.residualTolerance, "above 0 and below 1");
  if (!(options.changeTolerance >= 0 && std::isfinite(options.changeTolerance)))
    refuse("changeTolerance", options.changeTolerance, "finite and at least 0 (0 = stop by sweeps only)");
  if (options.smootherDegree < 0 || options.smootherDegree > 50)
    refuse("smootherDegree", options.smootherDegree, "from 0 to 50 (0 = the prior's default)");
  if (options.maxFactorBytes == 0)
    refuse("maxFactorBytes", options.maxFactorBytes, "above 0");
}

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
