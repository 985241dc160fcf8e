// SPDX-License-Identifier: BSD-3-Clause
/// Sums and products of whole vectors, in single or double precision.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include <cstdint>

namespace pcl::mrf {

/// Values per partial sum; a smaller sum is done before another thread is awake.
constexpr std::int64_t sumGrain = 1 << 18;

namespace kernels {
/// Σ x y in double precision, in a fixed order.
double dot(std::int64_t count, const float* x, const float* y);
double dot(std::int64_t count, const double* x, const double* y);
/// y = x + a y
void scaleAndAdd(std::int64_t count, float a, const float* x, float* y);
void scaleAndAdd(std::int64_t count, double a, const double* x, double* y);
} // namespace kernels

/// xᵀy in double precision; the same for any number of threads.
template <typename Vector>
double dotProduct(const Vector& x, const Vector& y, Execution& execution)
{
  return execution.sum(x.size(), sumGrain, [&](std::int64_t begin, std::int64_t end) {
    return kernels::dot(end - begin, x.data() + begin, y.data() + begin);
  });
}

/// y = x + a y
template <typename Vector>
void scaleAndAdd(typename Vector::value_type a, const Vector& x, Vector& y, Execution& execution)
{
  execution.forRange(x.size(), sumGrain, [&](std::int64_t begin, std::int64_t end) {
    kernels::scaleAndAdd(end - begin, a, x.data() + begin, y.data() + begin);
  });
}

} // namespace pcl::mrf
