#include "cholesky.h"

#include "linear_system.h"

#include <pcl/surface/mrf/exceptions.h>

#include <cmath>
#include <memory>
#include <sstream>

#ifdef MRF_HAVE_CHOLMOD
#include <cholmod.h>
#endif

namespace pcl {
namespace mrf {

#ifdef MRF_HAVE_CHOLMOD
namespace {

/// CHOLMOD's state and objects, released in any case. It must not print, as the library never does.
struct Cholmod {
  cholmod_common common;
  cholmod_factor* factor = nullptr;
  cholmod_dense* solution = nullptr;

  Cholmod()
  {
    cholmod_l_start(&common);
    common.print = 0;
    common.error_handler = nullptr;
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.useGPU = 0;
  }

  ~Cholmod()
  {
    cholmod_l_free_dense(&solution, &common);
    cholmod_l_free_factor(&factor, &common);
    cholmod_l_finish(&common);
  }

  Cholmod(const Cholmod&) = delete;
  Cholmod& operator=(const Cholmod&) = delete;

  /// \throw SolverFailure, ResourceLimit
  void check(const char* step, bool succeeded) const
  {
    if (succeeded && common.status == CHOLMOD_OK)
      return;
    const std::string where = std::string("cholesky: the ") + step;
    if (common.status == CHOLMOD_OUT_OF_MEMORY || common.status == CHOLMOD_TOO_LARGE)
      throw ResourceLimit(where + " ran out of memory; use the solver multigrid or a larger voxel size");
    if (common.status == CHOLMOD_NOT_POSDEF)
      throw SolverFailure(where + " found the matrix not positive definite; the observed voxels weigh too little, "
                                  "raise beta");
    throw SolverFailure(where + " failed with CHOLMOD's status " + std::to_string(common.status));
  }
};

/// Bytes of the supernodal factor that the analysis predicts: its numbers with their padding, and its indices.
std::size_t predictedBytes(const Cholmod& cholmod)
{
  const cholmod_factor& factor = *cholmod.factor;
  return factor.xsize * sizeof(double) + (factor.ssize + 3 * factor.nsuper + 4 * factor.n) * sizeof(SuiteSparse_long);
}

} // namespace

template <typename Real>
SolveReport solveCholesky(const LinearSystem<Real>& system, const SolverOptions& options, std::vector<Real>& d,
                          Execution& execution)
{
  static_assert(sizeof(SuiteSparse_long) == sizeof(std::int64_t), "CHOLMOD's long interface has 64-bit indices");
  Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t> matrix = systemMatrix(system);
  matrix.makeCompressed();
  execution.progress(.1);

  cholmod_sparse view{};
  view.nrow = view.ncol = static_cast<std::size_t>(matrix.rows());
  view.nzmax = static_cast<std::size_t>(matrix.nonZeros());
  view.p = matrix.outerIndexPtr();
  view.i = matrix.innerIndexPtr();
  view.x = matrix.valuePtr();
  view.stype = -1; // symmetric; only the lower triangle is read
  view.itype = CHOLMOD_LONG;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = 1;
  view.packed = 1;

  Cholmod cholmod;
  cholmod.factor = cholmod_l_analyze(&view, &cholmod.common);
  cholmod.check("analysis", cholmod.factor != nullptr);
  const std::size_t bytes = predictedBytes(cholmod);
  if (bytes > options.maxFactorBytes) {
    std::ostringstream message;
    message << "cholesky: the factor of " << matrix.rows() << " unknowns would take " << (bytes >> 20)
            << " MiB, more than maxFactorBytes (" << (options.maxFactorBytes >> 20)
            << " MiB); use the solver multigrid, or raise the limit";
    throw ResourceLimit(message.str());
  }
  execution.progress(.3);

  const bool factorised = cholmod_l_factorize(&view, cholmod.factor, &cholmod.common) != 0;
  cholmod.check("factorisation", factorised && cholmod.factor->minor == cholmod.factor->n);
  execution.progress(.9);

  const std::vector<Real>& b = system.data->rightHandSide();
  std::vector<double> rightHandSide(b.begin(), b.end());
  cholmod_dense rightHandSideView{};
  rightHandSideView.nrow = rightHandSideView.d = rightHandSideView.nzmax = rightHandSide.size();
  rightHandSideView.ncol = 1;
  rightHandSideView.x = rightHandSide.data();
  rightHandSideView.xtype = CHOLMOD_REAL;
  rightHandSideView.dtype = CHOLMOD_DOUBLE;
  cholmod.solution = cholmod_l_solve(CHOLMOD_A, cholmod.factor, &rightHandSideView, &cholmod.common);
  cholmod.check("solution", cholmod.solution != nullptr);
  const double* values = static_cast<const double*>(cholmod.solution->x);
  for (std::size_t i = 0; i < d.size(); ++i)
    d[i] = static_cast<Real>(values[i]);

  SolveReport report;
  report.method = SolverMethod::cholesky;
  report.iterations = 1;
  report.relativeResidual = relativeResidual(system, d, execution);
  report.converged = true;
  return report;
}

#else

template <typename Real>
SolveReport solveCholesky(const LinearSystem<Real>&, const SolverOptions&, std::vector<Real>&, Execution&)
{
  throw InvalidOption("solver is cholesky, but this build has no CHOLMOD; use the solver multigrid, or configure with "
                      "-DMRF_WITH_CHOLMOD=ON and libsuitesparse-dev installed");
}

#endif

template SolveReport solveCholesky(const LinearSystem<float>&, const SolverOptions&, std::vector<float>&, Execution&);
template SolveReport solveCholesky(const LinearSystem<double>&, const SolverOptions&, std::vector<double>&, Execution&);

} // namespace mrf
} // namespace pcl
