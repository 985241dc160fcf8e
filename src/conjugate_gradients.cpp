#include "conjugate_gradients.h"

#include "linear_system.h"
#include "plane_kernels.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>

namespace pcl {
namespace mrf {

template <typename Real>
SolveReport solveConjugateGradients(const LinearSystem<Real>& system, const SolverOptions& options,
                                    std::vector<Real>& d, Execution& execution)
{
  SolveReport report;
  report.method = SolverMethod::cg;
  const std::vector<Real>& b = system.data->rightHandSide();
  const int maxIterations = options.maxIterations > 0 ? options.maxIterations : 10000;
  const double norm = std::sqrt(dotProduct(b, b, execution));
  if (norm == 0) {
    std::fill(d.begin(), d.end(), Real(0));
    report.converged = true;
    return report;
  }
  const double target = options.residualTolerance * norm;
  const auto forAll = [&](const auto& body) {
    execution.forRange(static_cast<std::int64_t>(d.size()), sumGrain, body);
  };

  // r is the downhill gradient of the energy, p the direction conjugate to all before.
  std::vector<Real> r(d.size()), product(d.size());
  double squared = systemResidual(system, b.data(), d.data(), r.data(), execution);
  double restarted = squared;
  std::vector<Real> p = r;
  while (std::sqrt(squared) > target && report.iterations < maxIterations) {
    const double curvature = applySystemAndDot(system, p.data(), product.data(), execution);
    if (!std::isfinite(curvature) || !std::isfinite(squared))
      throw SolverFailure("cg: the iteration broke down with values that are not finite");
    if (!(curvature > 0))
      break; // nothing but rounding is left
    const Real step = static_cast<Real>(squared / curvature);
    forAll([&](std::int64_t begin, std::int64_t end) {
      kernels::addScaled(end - begin, step, p.data() + begin, d.data() + begin);
      kernels::addScaled(end - begin, -step, product.data() + begin, r.data() + begin);
    });
    const double next = dotProduct(r, r, execution);
    Real beta = static_cast<Real>(next / squared); // Fletcher–Reeves
    squared = next;
    ++report.iterations;
    bool stalled = false;
    if (std::sqrt(squared) <= target) {
      // The recursion drifts from the residual by rounding: what counts is the residual itself.
      squared = systemResidual(system, b.data(), d.data(), r.data(), execution);
      stalled = std::sqrt(squared) > target && squared > .25 * restarted;
      restarted = squared;
      beta = 0;
    }
    forAll([&](std::int64_t begin, std::int64_t end) {
      kernels::scaleAndAdd(end - begin, beta, r.data() + begin, p.data() + begin);
    });
    report.history.push_back(std::sqrt(squared) / norm);
    execution.progress(static_cast<double>(report.iterations) / maxIterations);
    if (stalled)
      break;
  }
  report.relativeResidual = std::sqrt(systemResidual(system, b.data(), d.data(), r.data(), execution)) / norm;
  report.converged = report.relativeResidual <= options.residualTolerance;
  return report;
}

template SolveReport solveConjugateGradients(const LinearSystem<float>&, const SolverOptions&, std::vector<float>&,
                                             Execution&);
template SolveReport solveConjugateGradients(const LinearSystem<double>&, const SolverOptions&, std::vector<double>&,
                                             Execution&);

} // namespace mrf
} // namespace pcl
