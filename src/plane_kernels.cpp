#include "plane_kernels.h"

#include "multiversioning.h"

namespace pcl {
namespace mrf {
namespace kernels {
namespace {

template <typename Real>
MRF_ALWAYS_INLINE void laplacianBody(int nx, int ny, const Real* below, const Real* centre, const Real* above,
                                     Real* __restrict out)
{
  for (int y = 0; y < ny; ++y) {
    const std::int64_t row = std::int64_t{nx} * y;
    const Real* c = centre + row;
    const Real* s = y > 0 ? c - nx : c;
    const Real* n = y + 1 < ny ? c + nx : c;
    const Real* d = below + row;
    const Real* u = above + row;
    Real* __restrict o = out + row;
    // The sum of six equal neighbours rounds to six times one of them, so constants are annihilated exactly.
    const auto at = [&](int x, int left, int right) {
      return 6 * c[x] - ((c[left] + c[right]) + (s[x] + n[x]) + (d[x] + u[x]));
    };
    if (nx == 1) {
      o[0] = at(0, 0, 0);
      continue;
    }
    o[0] = at(0, 0, 1);
    for (int x = 1; x < nx - 1; ++x)
      o[x] = 6 * c[x] - ((c[x - 1] + c[x + 1]) + (s[x] + n[x]) + (d[x] + u[x]));
    o[nx - 1] = at(nx - 1, nx - 2, nx - 1);
  }
}

template <typename Real>
MRF_ALWAYS_INLINE void weightedLaplacianBody(int nx, int ny, const Real* below, const Real* centre, const Real* above,
                                             const Real* weightBelow, const Real* weight, const Real* weightAbove,
                                             Real* __restrict out)
{
  for (int y = 0; y < ny; ++y) {
    const std::int64_t row = std::int64_t{nx} * y;
    const std::int64_t south = y > 0 ? -nx : 0, north = y + 1 < ny ? nx : 0;
    const Real* c = centre + row;
    const Real* v = weight + row;
    const Real *d = below + row, *vd = weightBelow + row;
    const Real *u = above + row, *vu = weightAbove + row;
    Real* __restrict o = out + row;
    const auto across = [&](int x) {
      return (v[x] + v[x + south]) * (c[x] - c[x + south]) + (v[x] + v[x + north]) * (c[x] - c[x + north]) +
             (v[x] + vd[x]) * (c[x] - d[x]) + (v[x] + vu[x]) * (c[x] - u[x]);
    };
    const auto edge = [&](int x, int j) { return (v[x] + v[j]) * (c[x] - c[j]); };
    const Real half = Real(.5);
    if (nx == 1) {
      o[0] = half * across(0);
      continue;
    }
    o[0] = half * (edge(0, 1) + across(0));
    for (int x = 1; x < nx - 1; ++x)
      o[x] = half * ((edge(x, x - 1) + edge(x, x + 1)) + across(x));
    o[nx - 1] = half * (edge(nx - 1, nx - 2) + across(nx - 1));
  }
}

template <typename Real>
MRF_ALWAYS_INLINE void prolongRowBody(int n, const Real* c, const Real* in, Real* __restrict out)
{
  const int last = (n + 1) / 2 - 1;
  const Real near = Real(.75), far = Real(.25);
  const auto even = [&](int j) { return near * c[j] + far * c[j > 0 ? j - 1 : 0]; };
  const auto odd = [&](int j) { return near * c[j] + far * c[j < last ? j + 1 : last]; };
  out[0] = in[0] + even(0);
  for (int j = 0; j < last; ++j) {
    const Real a = c[j], b = c[j + 1];
    out[2 * j + 1] = in[2 * j + 1] + (near * a + far * b);
    out[2 * j + 2] = in[2 * j + 2] + (near * b + far * a);
  }
  if (n % 2 == 0)
    out[n - 1] = in[n - 1] + odd(last);
}

template <typename Real>
MRF_ALWAYS_INLINE void restrictRowBody(int n, Real scale, const Real* f, Real* __restrict c)
{
  const int last = (n + 1) / 2 - 1;
  const Real near = Real(.75), far = Real(.25);
  // Where a voxel's second parent lies outside, its first one takes the whole weight.
  const auto at = [&](int j) {
    Real value = (j == 0 ? Real(1) : near) * f[2 * j];
    if (2 * j + 1 < n)
      value += (j == last ? Real(1) : near) * f[2 * j + 1];
    if (j > 0)
      value += far * f[2 * j - 1];
    if (2 * j + 2 < n)
      value += far * f[2 * j + 2];
    return scale * value;
  };
  c[0] = at(0);
  for (int j = 1; j < last; ++j)
    c[j] = scale * (near * (f[2 * j] + f[2 * j + 1]) + far * (f[2 * j - 1] + f[2 * j + 2]));
  if (last > 0)
    c[last] = at(last);
}

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

} // namespace

#define MRF_DEFINE_PLANE_KERNELS(Real)                                                                                 \
  MRF_MULTIVERSION(void, laplacian,                                                                                    \
                   (int nx, int ny, const Real* below, const Real* centre, const Real* above, Real* out),              \
                   (nx, ny, below, centre, above, out))                                                                \
  {                                                                                                                    \
    laplacianBody(nx, ny, below, centre, above, out);                                                                  \
  }                                                                                                                    \
  MRF_MULTIVERSION(void, weightedLaplacian,                                                                            \
                   (int nx, int ny, const Real* below, const Real* centre, const Real* above, const Real* weightBelow, \
                    const Real* weight, const Real* weightAbove, Real* out),                                           \
                   (nx, ny, below, centre, above, weightBelow, weight, weightAbove, out))                              \
  {                                                                                                                    \
    weightedLaplacianBody(nx, ny, below, centre, above, weightBelow, weight, weightAbove, out);                        \
  }                                                                                                                    \
  MRF_MULTIVERSION(void, multiply, (std::int64_t count, const Real* v, Real* __restrict y), (count, v, y))             \
  {                                                                                                                    \
    for (std::int64_t i = 0; i < count; ++i)                                                                           \
      y[i] *= v[i];                                                                                                    \
  }                                                                                                                    \
  MRF_MULTIVERSION(void, addProduct, (std::int64_t count, const Real* v, const Real* x, Real* __restrict y),           \
                   (count, v, x, y))                                                                                   \
  {                                                                                                                    \
    for (std::int64_t i = 0; i < count; ++i)                                                                           \
      y[i] += v[i] * x[i];                                                                                             \
  }                                                                                                                    \
  MRF_MULTIVERSION(                                                                                                    \
      void, smoothZero,                                                                                                \
      (std::int64_t count, Real g, const Real* b, const Real* inverseD, Real* __restrict z, Real* __restrict x),       \
      (count, g, b, inverseD, z, x))                                                                                   \
  {                                                                                                                    \
    for (std::int64_t i = 0; i < count; ++i)                                                                           \
      x[i] = z[i] = g * inverseD[i] * b[i];                                                                            \
  }                                                                                                                    \
  MRF_MULTIVERSION(void, smoothFirst,                                                                                  \
                   (std::int64_t count, Real g, const Real* product, const Real* b, const Real* inverseD,              \
                    Real* __restrict z, Real* __restrict x),                                                           \
                   (count, g, product, b, inverseD, z, x))                                                             \
  {                                                                                                                    \
    for (std::int64_t i = 0; i < count; ++i) {                                                                         \
      z[i] = g * inverseD[i] * (b[i] - product[i]);                                                                    \
      x[i] += z[i];                                                                                                    \
    }                                                                                                                  \
  }                                                                                                                    \
  MRF_MULTIVERSION(void, smooth,                                                                                       \
                   (std::int64_t count, Real f, Real g, const Real* product, const Real* b, const Real* inverseD,      \
                    Real* __restrict z, Real* __restrict x),                                                           \
                   (count, f, g, product, b, inverseD, z, x))                                                          \
  {                                                                                                                    \
    for (std::int64_t i = 0; i < count; ++i) {                                                                         \
      z[i] = f * z[i] + g * inverseD[i] * (b[i] - product[i]);                                                         \
      x[i] += z[i];                                                                                                    \
    }                                                                                                                  \
  }                                                                                                                    \
  MRF_MULTIVERSION(void, residual, (std::int64_t count, const Real* product, const Real* b, Real* __restrict r),       \
                   (count, product, b, r))                                                                             \
  {                                                                                                                    \
    for (std::int64_t i = 0; i < count; ++i)                                                                           \
      r[i] = b[i] - product[i];                                                                                        \
  }                                                                                                                    \
  MRF_MULTIVERSION(void, blend, (std::int64_t count, const Real* a, const Real* b, Real* __restrict out),              \
                   (count, a, b, out))                                                                                 \
  {                                                                                                                    \
    for (std::int64_t i = 0; i < count; ++i)                                                                           \
      out[i] = Real(.75) * a[i] + Real(.25) * b[i];                                                                    \
  }                                                                                                                    \
  MRF_MULTIVERSION(void, prolongRow, (int n, const Real* coarse, const Real* in, Real* out), (n, coarse, in, out))     \
  {                                                                                                                    \
    prolongRowBody(n, coarse, in, out);                                                                                \
  }                                                                                                                    \
  MRF_MULTIVERSION(void, restrictRow, (int n, Real scale, const Real* fine, Real* coarse), (n, scale, fine, coarse))   \
  {                                                                                                                    \
    restrictRowBody(n, scale, fine, coarse);                                                                           \
  }                                                                                                                    \
  MRF_MULTIVERSION(void, combine,                                                                                      \
                   (std::int64_t count, const Real* a, Real wa, const Real* b, Real wb, const Real* c, Real wc,        \
                    const Real* d, Real wd, Real* __restrict out),                                                     \
                   (count, a, wa, b, wb, c, wc, d, wd, out))                                                           \
  {                                                                                                                    \
    for (std::int64_t i = 0; i < count; ++i)                                                                           \
      out[i] = (wa * a[i] + wb * b[i]) + (wc * c[i] + wd * d[i]);                                                      \
  }                                                                                                                    \
  MRF_MULTIVERSION(void, addScaled, (std::int64_t count, Real a, const Real* x, Real* __restrict y), (count, a, x, y)) \
  {                                                                                                                    \
    for (std::int64_t i = 0; i < count; ++i)                                                                           \
      y[i] += a * x[i];                                                                                                \
  }                                                                                                                    \
  MRF_MULTIVERSION(void, scaleAndAdd, (std::int64_t count, Real a, const Real* x, Real* __restrict y),                 \
                   (count, a, x, y))                                                                                   \
  {                                                                                                                    \
    for (std::int64_t i = 0; i < count; ++i)                                                                           \
      y[i] = x[i] + a * y[i];                                                                                          \
  }                                                                                                                    \
  MRF_MULTIVERSION(double, dot, (std::int64_t count, const Real* x, const Real* y), (count, x, y))                     \
  {                                                                                                                    \
    return dotBody(count, x, y);                                                                                       \
  }

MRF_DEFINE_PLANE_KERNELS(float)
MRF_DEFINE_PLANE_KERNELS(double)

} // namespace kernels
} // namespace mrf
} // namespace pcl
