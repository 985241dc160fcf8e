// SPDX-License-Identifier: BSD-3-Clause
/// The interface of libpcl_mrf_cholesky, the module between the library and CHOLMOD.
///
/// Debian's CHOLMOD is under the GPL. The library loads the module at run time and does not link to it, so that the GPL
/// does not bind programs without it. The interface has only types of C.
#pragma once

#include <cstdint>

namespace pcl::mrf {

/// A x = b, A symmetric positive definite.
struct CholeskyProblem {
  std::int64_t unknowns;
  const std::int64_t* columns; ///< index of the first entry of each column of A's lower triangle, and the end
  const std::int64_t* rows;    ///< row of each entry, ascending in each column
  const double* values;
  const std::int64_t* order; ///< the unknowns in the order of their elimination
  const double* rightHandSide;
  double* solution;
  double maxBytes; ///< that the factorization may take
  double maxFlops; ///< likewise; it cannot be cancelled once it has begun
};

enum class CholeskyOutcome : std::int32_t {
  solved,
  tooLarge,            ///< more than maxBytes
  tooLong,             ///< more than maxFlops
  notPositiveDefinite, ///< or with values that are not finite
  outOfMemory,
  failed ///< CHOLMOD refuses the matrix
};

struct CholeskyResult {
  CholeskyOutcome outcome;
  double bytes; ///< that the factorization takes, the factor included; known after the analysis
  double flops; ///< of the factorization; likewise
};

using CholeskySolve = void(const CholeskyProblem* problem, CholeskyResult* result);

/// The name of the module's only function, a CholeskySolve. Change it whenever the types above change.
constexpr const char* choleskySymbol = "pcl_mrf_cholesky_1";

} // namespace pcl::mrf
