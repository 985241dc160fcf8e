/// \file
/// \brief The multigrid smoother: Chebyshev polynomials of the 4th kind, all of their steps in one sweep over memory.
#pragma once

#include <pcl/surface/mrf/data_term.h>
#include <pcl/surface/mrf/execution.h>

#include <cstddef>
#include <vector>

namespace pcl {
namespace mrf {

/// How a grid is cut for sweeps.
struct SlabPlan {
  int thickness;     ///< planes per slab
  int stepsPerSweep; ///< of the smoother
};

/// Chebyshev smoother of the 4th kind for one system (DESIGN: z₁ = 4/(3λ) D⁻¹r, z_i = (2i−3)/(2i+1) z_{i−1} +
/// (8i−4)/((2i+1)λ) D⁻¹r_i), and the transfers to the next coarser grid that go with it.
///
/// Step i follows k + 1 planes behind step i − 1, so the iterate, the search direction and the powers of L stay in
/// cache and memory is read once per sweep instead of once per step. The steps update the iterate in place. A slab
/// recomputes k planes of its neighbours for each step; where slabs are thin, or planes too large for the cache, a
/// sweep takes only some of the steps. None of this changes the values.
template <typename Real>
class Smoother {
public:
  /// \pre the system outlives the smoother
  Smoother(const LinearSystem<Real>& system, int degree, Execution& execution);
  Smoother(Smoother&&) noexcept;
  ~Smoother();

  /// x = S b from a zero initial guess; residual = b − A x.
  void smoothFromZero(const Real* b, Real* x, Real* residual, Execution& execution);

  /// out = `degree` steps from the initial guess x + P coarse. \pre x and out differ
  void smoothCorrected(const Real* b, const Real* x, const Real* coarse, Real* out, Execution& execution);

  /// coarse = scale · Pᵀ fine, the scale being 4^k over the number of children, damped for k = 3.
  void restrictTo(const Real* fine, Real* coarse, Execution& execution) const;

  /// Bytes that a smoother of a grid comes to hold.
  static double predictedBytes(const GridSize& size, Prior prior, int degree, int threads);

private:
  enum class Source { zero, corrected, iterate };

  /// Steps [first, last] of the polynomial.
  struct Sweep {
    Source source = Source::zero;
    int first = 1, last = 1;
    const Real* b = nullptr;
    const Real* x = nullptr;           ///< iterate at the start, unless it is zero
    const Real* coarse = nullptr;      ///< correction to be prolonged, with Source::corrected
    const Real* directionIn = nullptr; ///< z of step first − 1, with Source::iterate
    Real* out = nullptr;
    Real* directionOut = nullptr; ///< z of the last step, if a sweep follows
    Real* residual = nullptr;     ///< if wanted
  };
  struct Workspace;

  void smooth(const Sweep& whole, Execution& execution);
  void runSlab(const Sweep& sweep, int zBegin, int zEnd, Workspace& workspace) const;
  void prolongPlane(int z, const Real* coarse, const Real* in, Real* out, Real* scratch) const;

  const LinearSystem<Real>* system_;
  int degree_;
  int order_;
  SlabPlan plan_;
  Real bound_; ///< λ
  std::vector<Real> inverseD_;
  std::vector<Workspace> workspaces_;         ///< per slab
  std::vector<Real> iterate_, directions_[2]; ///< between sweeps, where one does not do
};

} // namespace mrf
} // namespace pcl
