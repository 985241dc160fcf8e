// SPDX-License-Identifier: BSD-3-Clause
#include "solver/cholesky.h"

#include "base/arrays.h"
#include "base/memory.h"
#include "base/module.h"
#include "field/prior.h"
#include "solver/cholesky_module.h"
#include "solver/nested_dissection.h"

#include <pcl/surface/mrf/exceptions.h>

#include <cmath>
#include <string>

namespace pcl::mrf {
namespace {

constexpr double flopsPerSecond = 2.5e10;

/// The module's function; the first call loads the module.
CholeskySolve* moduleFunction()
{
  static CholeskySolve* const loaded = [] {
    void* const found = shownByModule(MRF_CHOLESKY_MODULE, choleskySymbol);
    if (found == nullptr)
      throw SolverFailure(std::string("the solver cholesky needs ") + MRF_CHOLESKY_MODULE +
                          ", of the package " MRF_CHOLESKY_PACKAGE ", which cannot be loaded: " + dlerror() +
                          "; install it, or use the solver multigrid");
    return reinterpret_cast<CholeskySolve*>(found);
  }();
  return loaded;
}

} // namespace

double choleskyBytes(const GridSize& size, Prior prior, bool pointwise)
{
  // Besides the factor: its largest update, at most a seventh of it; the matrix's triangle, twice; some vectors.
  constexpr double update = 1.15, bytesPerEntry = 2 * (sizeof(double) + sizeof(std::int64_t)), bytesPerVoxel = 150;
  return update * factorCost(size, {order(prior), pointwise}).bytes +
         (bytesPerEntry * .5 * entriesPerVoxel(prior, pointwise) + bytesPerVoxel) * static_cast<double>(size.count());
}

double choleskySeconds(const GridSize& size, Prior prior, bool pointwise)
{
  return factorCost(size, {order(prior), pointwise}).flops / flopsPerSecond;
}

void requireCholesky()
{
  moduleFunction();
}

SolveReport solveCholesky(const LinearSystem& system, std::vector<double>& d, Execution& execution)
{
  CholeskySolve* const solve = moduleFunction();
  // The upper triangle of a symmetric matrix stored by rows has the same arrays as the lower one stored by columns.
  const Eigen::SparseMatrix<double, Eigen::RowMajor, std::int64_t> triangle =
      system.matrix.triangularView<Eigen::Upper>();
  execution.poll();
  const std::vector<std::int64_t> order = dissectionOrder(system.size, system.coupling);
  CholeskyProblem problem;
  problem.unknowns = system.size.count();
  problem.columns = triangle.outerIndexPtr();
  problem.rows = triangle.innerIndexPtr();
  problem.values = triangle.valuePtr();
  problem.order = order.data();
  problem.rightHandSide = system.rightHandSide.data();
  problem.solution = d.data();
  problem.maxBytes = memoryLimit(0);
  problem.maxFlops = maxCholeskySeconds * flopsPerSecond;
  CholeskyResult result;
  solve(&problem, &result);
  execution.progress(1);
  const std::string factor = "cholesky: the factor of " + std::to_string(system.size.count()) + " unknowns";
  const auto upwards = [](double value) { return std::to_string(static_cast<std::int64_t>(std::ceil(value))); };
  switch (result.outcome) {
  case CholeskyOutcome::solved:
    break;
  case CholeskyOutcome::tooLong:
    throw ResourceLimit(factor + " would take some " + upwards(result.flops / flopsPerSecond) +
                        " s, in which the run could not be cancelled; use the solver multigrid or larger voxels");
  case CholeskyOutcome::tooLarge:
  case CholeskyOutcome::outOfMemory:
    throw ResourceLimit(factor + " would take " + upwards(result.bytes / (1 << 20)) +
                        " MiB, more than is free; use the solver multigrid or larger voxels");
  case CholeskyOutcome::notPositiveDefinite:
    throw SolverFailure("cholesky: the matrix is not positive definite; check the confidences and the voxel size");
  case CholeskyOutcome::failed:
    throw SolverFailure("cholesky: CHOLMOD refuses the matrix");
  }

  SolveReport report;
  report.method = SolverMethod::cholesky;
  report.iterations = 1;
  report.relativeResidual = relativeResidual(system, d, execution);
  report.converged = true;
  return report;
}

} // namespace pcl::mrf
