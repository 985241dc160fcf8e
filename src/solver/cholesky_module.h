// SPDX-License-Identifier: BSD-3-Clause
/// What the library asks of libpcl_mrf_cholesky, the module that stands between it and CHOLMOD.
///
/// Debian's CHOLMOD is under the GPL. The library loads the module while it runs and links to nothing of it, so that
/// programs without it are bound by nothing. Only types of C cross the border.
#pragma once

#include <cstdint>

namespace pcl::mrf {

/// A x = b, A symmetric positive definite.
struct CholeskyProblem {
  std::int64_t unknowns;
  const std::int64_t* columns; ///< of A's lower triangle: where each begins, and the end
  const std::int64_t* rows;    ///< of its entries, ascending in each column
  const double* values;
  const std::int64_t* order; ///< the unknowns in the order of their elimination
  const double* rightHandSide;
  double* solution;
  double maxBytes; ///< that the factorization may take
  double maxFlops; ///< likewise; it cannot be left once it has begun
};

enum class CholeskyOutcome : std::int32_t {
  solved,
  tooLarge,            ///< more than maxBytes
  tooLong,             ///< more than maxFlops
  notPositiveDefinite, ///< or values that are not finite
  outOfMemory,
  failed ///< CHOLMOD refuses
};

struct CholeskyResult {
  CholeskyOutcome outcome;
  double bytes; ///< of the factor, and of what makes it; known after the analysis
  double flops; ///< of the factorization
};

using CholeskySolve = void(const CholeskyProblem* problem, CholeskyResult* result);

/// The module's only name, a CholeskySolve; it changes with what is above.
constexpr const char* choleskySymbol = "pcl_mrf_cholesky_1";

} // namespace pcl::mrf
