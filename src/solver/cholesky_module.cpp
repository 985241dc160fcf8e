// SPDX-License-Identifier: BSD-3-Clause
// libpcl_mrf_cholesky: supernodal factorization by CHOLMOD (Chen, Davis, Hager, Rajamanickam 2008). The compiled module
// is under the GPL, as Debian's CHOLMOD is.
#include "solver/cholesky_module.h"

#include <suitesparse/cholmod.h>

#include <algorithm>

extern "C" {
// Functions of OpenBLAS; null if the system's BLAS is another one.
__attribute__((weak)) void openblas_set_num_threads(int threads);
__attribute__((weak)) int openblas_get_num_threads(void);
__attribute__((visibility("default"))) pcl::mrf::CholeskySolve pcl_mrf_cholesky_1;
}

namespace {

using namespace pcl::mrf;

/// Makes the BLAS use one thread while the object exists: with several, the last digits depend on their number.
class OneThread {
public:
  OneThread()
  {
    if (openblas_set_num_threads)
      openblas_set_num_threads(1);
  }
  ~OneThread()
  {
    if (openblas_set_num_threads)
      openblas_set_num_threads(before_);
  }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

private:
  int before_ = openblas_get_num_threads ? openblas_get_num_threads() : 1;
};

class Workspace {
public:
  Workspace()
  {
    cholmod_l_start(&common_);
    common_.print = 0;
    common_.supernodal = CHOLMOD_SUPERNODAL;
    common_.nmethods = 1;
    common_.method[0].ordering = CHOLMOD_GIVEN;
  }
  ~Workspace()
  {
    cholmod_l_free_dense(&solution_, &common_);
    cholmod_l_free_factor(&factor_, &common_);
    cholmod_l_finish(&common_);
  }
  Workspace(const Workspace&) = delete;
  Workspace& operator=(const Workspace&) = delete;

  CholeskyOutcome solve(const CholeskyProblem& problem, CholeskyResult& result)
  {
    // CHOLMOD's functions take pointers to non-const data even where they only read.
    cholmod_sparse matrix{};
    matrix.nrow = matrix.ncol = static_cast<std::size_t>(problem.unknowns);
    matrix.nzmax = static_cast<std::size_t>(problem.columns[problem.unknowns]);
    matrix.p = const_cast<std::int64_t*>(problem.columns);
    matrix.i = const_cast<std::int64_t*>(problem.rows);
    matrix.x = const_cast<double*>(problem.values);
    matrix.stype = -1;
    matrix.itype = CHOLMOD_LONG;
    matrix.xtype = CHOLMOD_REAL;
    matrix.dtype = CHOLMOD_DOUBLE;
    matrix.sorted = matrix.packed = 1;

    auto* const order = reinterpret_cast<SuiteSparse_long*>(const_cast<std::int64_t*>(problem.order));
    factor_ = cholmod_l_analyze_p(&matrix, order, nullptr, 0, &common_);
    if (!factor_ || common_.status < CHOLMOD_OK)
      return failure();
    // The factor, its largest update, and the matrix permuted.
    result.bytes = static_cast<double>(common_.memory_inuse) +
                   static_cast<double>(factor_->xsize + factor_->maxcsize) * sizeof(double) +
                   static_cast<double>(matrix.nzmax) * (sizeof(double) + sizeof(SuiteSparse_long));
    result.flops = common_.fl;
    if (result.bytes > problem.maxBytes)
      return CholeskyOutcome::tooLarge;
    if (result.flops > problem.maxFlops)
      return CholeskyOutcome::tooLong;

    cholmod_l_factorize(&matrix, factor_, &common_);
    if (common_.status != CHOLMOD_OK)
      return failure();
    cholmod_dense rightHandSide{};
    rightHandSide.nrow = rightHandSide.d = rightHandSide.nzmax = matrix.nrow;
    rightHandSide.ncol = 1;
    rightHandSide.x = const_cast<double*>(problem.rightHandSide);
    rightHandSide.xtype = CHOLMOD_REAL;
    rightHandSide.dtype = CHOLMOD_DOUBLE;
    solution_ = cholmod_l_solve(CHOLMOD_A, factor_, &rightHandSide, &common_);
    if (!solution_ || common_.status != CHOLMOD_OK)
      return failure();
    std::copy_n(static_cast<const double*>(solution_->x), problem.unknowns, problem.solution);
    return CholeskyOutcome::solved;
  }

private:
  CholeskyOutcome failure() const
  {
    return common_.status == CHOLMOD_OUT_OF_MEMORY || common_.status == CHOLMOD_TOO_LARGE ? CholeskyOutcome::outOfMemory
           : common_.status == CHOLMOD_NOT_POSDEF ? CholeskyOutcome::notPositiveDefinite
                                                  : CholeskyOutcome::failed;
  }

  cholmod_common common_{};
  cholmod_factor* factor_ = nullptr;
  cholmod_dense* solution_ = nullptr;
};

} // namespace

void pcl_mrf_cholesky_1(const CholeskyProblem* problem, CholeskyResult* result)
{
  const OneThread oneThread;
  *result = {};
  result->outcome = Workspace().solve(*problem, *result);
}
