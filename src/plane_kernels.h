/// \file
/// \brief The solvers' inner loops on plain arrays, one plane of voxels at a time.
#pragma once

#include <cstdint>

namespace pcl {
namespace mrf {
namespace kernels {

// Every function exists for float and double; the second set is declared by the same macro so that the two cannot
// differ.
#define MRF_DECLARE_PLANE_KERNELS(Real)                                                                                \
  /** out = L x on one plane of nx × ny voxels. At a border of the grid pass the plane itself for the missing one. */ \
  void laplacian(int nx, int ny, const Real* below, const Real* centre, const Real* above, Real* out);                 \
  /** out = L_v x, the Laplacian whose edges weigh the mean of their two voxels' v. */                                 \
  void weightedLaplacian(int nx, int ny, const Real* below, const Real* centre, const Real* above,                     \
                         const Real* weightBelow, const Real* weight, const Real* weightAbove, Real* out);             \
  /** y *= v */                                                                                                        \
  void multiply(std::int64_t count, const Real* v, Real* y);                                                           \
  /** y += v * x */                                                                                                    \
  void addProduct(std::int64_t count, const Real* v, const Real* x, Real* y);                                          \
  /** First Chebyshev step from zero: x = z = g D⁻¹ b. */                                                           \
  void smoothZero(std::int64_t count, Real g, const Real* b, const Real* inverseD, Real* z, Real* x);                  \
  /** First Chebyshev step: z = g D⁻¹ (b − Ax), x += z. */                                                        \
  void smoothFirst(std::int64_t count, Real g, const Real* product, const Real* b, const Real* inverseD, Real* z,      \
                   Real* x);                                                                                           \
  /** Next Chebyshev step: z = f z + g D⁻¹ (b − Ax), x += z. */                                                   \
  void smooth(std::int64_t count, Real f, Real g, const Real* product, const Real* b, const Real* inverseD, Real* z,   \
              Real* x);                                                                                                \
  /** r = b − Ax */                                                                                                  \
  void residual(std::int64_t count, const Real* product, const Real* b, Real* r);                                      \
  /** out[i] = ¾ a[i] + ¼ b[i] */                                                                                    \
  void blend(std::int64_t count, const Real* a, const Real* b, Real* out);                                             \
  /** Adds a coarse row of ⌈n/2⌉ values, interpolated with (¾, ¼), to n fine values: out = in + P c. */          \
  void prolongRow(int n, const Real* coarse, const Real* in, Real* out);                                               \
  /** coarse = scale · Pᵀ fine for one row. */                                                                      \
  void restrictRow(int n, Real scale, const Real* fine, Real* coarse);                                                 \
  /** out = wa a + wb b + wc c + wd d */                                                                               \
  void combine(std::int64_t count, const Real* a, Real wa, const Real* b, Real wb, const Real* c, Real wc,             \
               const Real* d, Real wd, Real* out);                                                                     \
  /** y += a x */                                                                                                      \
  void addScaled(std::int64_t count, Real a, const Real* x, Real* y);                                                  \
  /** y = x + a y */                                                                                                   \
  void scaleAndAdd(std::int64_t count, Real a, const Real* x, Real* y);                                                \
  /** Σ x y in double precision, in a fixed order. */                                                                 \
  double dot(std::int64_t count, const Real* x, const Real* y);

MRF_DECLARE_PLANE_KERNELS(float)
MRF_DECLARE_PLANE_KERNELS(double)
#undef MRF_DECLARE_PLANE_KERNELS

} // namespace kernels
} // namespace mrf
} // namespace pcl
