/// \file
/// \brief The observation model as the solvers see it: a symmetric positive semidefinite operator C and a right-hand
/// side.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/lattice.h>
#include <pcl/surface/mrf/observation.h>
#include <pcl/surface/mrf/prior.h>

#include <Eigen/SparseCore>

#include <memory>
#include <vector>

namespace pcl {
namespace mrf {

/// C and b of the system (P + C) d = b, scaled to match the prior operator P with its integer coefficients.
///
/// The paper's observation is a diagonal C = c_k W (DiagonalDataTerm). Observing the field at the points themselves
/// gives a 27-point block on occupied cells; it implements the same interface. Solvers use nothing else.
template <typename Real>
class DataTerm {
public:
  virtual ~DataTerm() = default;

  virtual GridSize size() const = 0;

  /// y += C x on plane z. The solvers keep only a window of x in memory order, so x comes as the planes z − 1, z and
  /// z + 1; at the grid's border the missing one is the plane z itself. Called concurrently.
  virtual void addPlaneProduct(int z, const Real* below, const Real* centre, const Real* above, Real* y) const = 0;

  /// y += C x for the planes z in [zBegin, zEnd) of whole arrays.
  void addProduct(const Real* x, Real* y, int zBegin, int zEnd) const;

  /// b, one value per voxel.
  virtual const std::vector<Real>& rightHandSide() const = 0;

  /// Diagonal of C, one value per voxel; D = c_k + diagonal scales the smoothers.
  virtual const std::vector<Real>& diagonal() const = 0;

  /// Bound on the largest eigenvalue of diag(C)⁻¹ C: 1 for a diagonal C.
  virtual Real spectralBound() const = 0;

  /// The term on the grid size().coarsened(), scaled for a prior of the given order as a multigrid level needs it
  /// (right-hand side not needed, may be empty). An axis of one voxel stays as it is.
  virtual std::unique_ptr<DataTerm> coarsened(Prior prior, Execution& execution) const = 0;

  /// True if C has no entry off its diagonal.
  virtual bool isDiagonal() const = 0;

  /// Appends the entries of C (both triangles).
  virtual void appendEntries(std::vector<Eigen::Triplet<double, std::int64_t>>& entries) const = 0;
};

/// C = diag(weights), b = weights · targets.
/// Coarsened weights are 4^k × the mean of the (up to) 8 children's.
template <typename Real>
std::unique_ptr<DataTerm<Real>> makeDiagonalDataTerm(GridSize size, std::vector<Real> weights,
                                                     const std::vector<Real>& targets);

/// A prior operator with its data term: the linear system (P + C) d = b of one level, symmetric positive definite as
/// soon as one voxel is observed.
template <typename Real>
struct LinearSystem {
  PriorOperator<Real> prior;
  std::unique_ptr<DataTerm<Real>> data;

  GridSize size() const { return prior.size; }
};

/// w = a/(1 − a), a = αβ clamped to 1 − 10⁻⁶: an infinite weight would leave a voxel without any prior.
double dataWeight(double confidence, double beta);

/// The voxel-wise system of the paper. a_i = α_i β.
/// Energy::joint: (L^k + c_k W) d = c_k W d°, w_i = a_i / (1 − a_i) with a_i clamped to 1 − 10⁻⁶.
/// Energy::weighted: (P_v + c_k A) d = c_k A d° with v_i = 1 − a_i; for constant a the same as joint.
template <typename Real>
LinearSystem<Real> assemble(const Observation& observation, const PriorOptions& options);

} // namespace mrf
} // namespace pcl
