// SPDX-License-Identifier: BSD-3-Clause
#include "base/vector_kernels.h"

#include "base/multiversioning.h"

namespace pcl::mrf::kernels {
namespace {

template <typename Real>
MRF_ALWAYS_INLINE double dotBody(std::int64_t count, const Real* x, const Real* y)
{
  constexpr int lanes = 16;
  double sums[lanes] = {};
  std::int64_t i = 0;
  for (; i + lanes <= count; i += lanes)
    for (int lane = 0; lane < lanes; ++lane)
      sums[lane] += static_cast<double>(x[i + lane]) * static_cast<double>(y[i + lane]);
  double total = 0;
  for (; i < count; ++i)
    total += static_cast<double>(x[i]) * static_cast<double>(y[i]);
  for (const double sum : sums)
    total += sum;
  return total;
}

template <typename Real>
MRF_ALWAYS_INLINE void scaleAndAddBody(std::int64_t count, Real a, const Real* x, Real* __restrict y)
{
  for (std::int64_t i = 0; i < count; ++i)
    y[i] = x[i] + a * y[i];
}

} // namespace

MRF_MULTIVERSION(double, dot, (std::int64_t count, const float* x, const float* y), (count, x, y))
{
  return dotBody(count, x, y);
}

MRF_MULTIVERSION(double, dot, (std::int64_t count, const double* x, const double* y), (count, x, y))
{
  return dotBody(count, x, y);
}

MRF_MULTIVERSION(void, scaleAndAdd, (std::int64_t count, float a, const float* x, float* y), (count, a, x, y))
{
  scaleAndAddBody(count, a, x, y);
}

MRF_MULTIVERSION(void, scaleAndAdd, (std::int64_t count, double a, const double* x, double* y), (count, a, x, y))
{
  scaleAndAddBody(count, a, x, y);
}

} // namespace pcl::mrf::kernels
