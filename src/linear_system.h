/// \file
/// \brief What the solvers share: products with the whole system, dot products, slabs, the explicit matrix.
#pragma once

#include <pcl/surface/mrf/data_term.h>
#include <pcl/surface/mrf/execution.h>

#include <Eigen/SparseCore>

#include <vector>

namespace pcl {
namespace mrf {

/// Below this size the overhead of waking threads exceeds what they gain.
constexpr std::int64_t serialVoxels = 100000;

/// Voxels per partial sum of a dot product; fewer are added before another thread is awake.
constexpr std::int64_t sumGrain = 1 << 18;

/// Share of the coarse correction that is taken. The rediscretised L³ overcorrects: measured on a head of 1.2 million
/// voxels, .3 to .5 needs half the iterations of 1; with observations at points, which come with weaker coarse weights,
/// .6 to .8 does. Lower orders want all of it.
template <typename Real>
Real coarseDamping(int order, bool dataAreDiagonal)
{
  return order < 3 ? Real(1) : dataAreDiagonal ? Real(.4) : Real(.7);
}

/// Planes per slab: one slab per thread, one in all on small grids. Planes are computed alike whatever the slab, so
/// this may depend on the number of threads.
int slabThickness(const GridSize& size, int threads);

/// The mean of the up to 8 children of each voxel of the grid size.coarsened(), times `scale`.
template <typename Real>
std::vector<Real> meanOfChildren(const GridSize& size, const std::vector<Real>& values, Real scale);

/// y = (P + C) x.
template <typename Real>
void applySystem(const LinearSystem<Real>& system, const Real* x, Real* y, Execution& execution);

/// y = (P + C) x. \return xᵀ(P + C)x
template <typename Real>
double applySystemAndDot(const LinearSystem<Real>& system, const Real* x, Real* y, Execution& execution);

/// r = b − (P + C) x. \return ‖r‖²
template <typename Real>
double systemResidual(const LinearSystem<Real>& system, const Real* b, const Real* x, Real* r, Execution& execution);

/// xᵀy in double precision; the same for any number of threads.
template <typename Real>
double dotProduct(std::size_t count, const Real* x, const Real* y, Execution& execution);

/// The same of two vectors.
template <typename Vector>
double dotProduct(const Vector& x, const Vector& y, Execution& execution)
{
  return dotProduct(x.size(), x.data(), y.data(), execution);
}

/// P as an explicit matrix.
template <typename Real>
Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t> priorMatrix(const PriorOperator<Real>& prior);

/// P + C as an explicit matrix, both triangles. About 7, 25 or 63 entries per voxel for k = 1, 2, 3.
template <typename Real>
Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t> systemMatrix(const LinearSystem<Real>& system);

} // namespace mrf
} // namespace pcl
