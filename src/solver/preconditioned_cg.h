// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Preconditioned conjugate gradients, whatever the vectors are stored as.
#pragma once

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>

#include <algorithm>
#include <cmath>

namespace pcl {
namespace mrf {

/// A mean square in the making.
struct SquareSum {
  double squares = 0, count = 0;

  void add(double value)
  {
    squares += value * value;
    ++count;
  }
  void add(const SquareSum& other)
  {
    squares += other.squares;
    count += other.count;
  }
  double rms() const { return count > 0 ? std::sqrt(squares / count) : 0; }
};

/// Sums of one step.
struct StepSums {
  double residual = 0;         ///< squares of r
  SquareSum observed, filling; ///< the step at voxels near the zero level: observed ones, and others
};

/// When the iteration ends.
struct StepLimits {
  int maxIterations;
  double residual; ///< relative to the scale
  double change;   ///< RMS at observed voxels near the zero level, in voxel sides; 0: not by it
  /// Relative residual that a small change must come with: between few points the field has a long way to go after the
  /// voxels at them stand still.
  double residualOfChange;
  double unit;  ///< a voxel side in the unit of the field
  double scale; ///< of the residual
};

/// What all further steps change if each has as much less to do as the residual fell by in a step.
inline double remainingChange(double lastChange, double ratio)
{
  constexpr double largestRatio = .9; // the residual of conjugate gradients may grow for a while
  const double bounded = std::min(ratio, largestRatio);
  return lastChange * bounded / (1 - bounded);
}

/// \param system with
///   double precondition(): z = M r; returns rᵀz
///   double multiply(double beta): p = z + β p and A p; returns pᵀAp
///   StepSums step(double length): d += length · p, r −= length · A p
/// \param squaredResidual of the guess \param report added to; its iterations count for the limit
/// \return true if a step changed less than the limit
/// \throw SolverFailure if values are not finite
template <typename System>
bool iterate(System& system, const StepLimits& limits, double squaredResidual, SolveReport& report,
             Execution& execution)
{
  report.relativeResidual = std::sqrt(squaredResidual) / limits.scale;
  double before = report.relativeResidual, beforeThat = before;
  const double initial = std::max(report.relativeResidual, limits.residual);
  double gamma = 0;
  bool settled = false, isFirst = true;
  while (!settled && report.relativeResidual > limits.residual && report.iterations < limits.maxIterations) {
    const double next = system.precondition();
    const double curvature = system.multiply(isFirst ? 0 : next / gamma);
    gamma = next;
    if (!(std::isfinite(gamma) && std::isfinite(curvature)))
      throw SolverFailure("multigrid: the iteration broke down with values that are not finite");
    if (!(curvature > 0 && gamma > 0))
      break; // nothing but rounding is left
    const StepSums sums = system.step(gamma / curvature);
    ++report.iterations;
    report.relativeResidual = std::sqrt(sums.residual) / limits.scale;
    const double observed = sums.observed.rms() / limits.unit, filling = sums.filling.rms() / limits.unit;
    settled = sums.observed.count > 0 && observed < limits.change && report.relativeResidual < limits.residualOfChange;
    // Single steps are uneven: the mean of two, where there are two.
    const double ratio = isFirst ? report.relativeResidual / before : std::sqrt(report.relativeResidual / beforeThat);
    report.remainingChange = remainingChange(observed, ratio);
    report.remainingChangeOfFillings = remainingChange(filling, ratio);
    beforeThat = before;
    before = report.relativeResidual;
    isFirst = false;
    report.history.push_back(report.relativeResidual);
    execution.progress(std::clamp(std::log(initial / std::max(report.relativeResidual, 1e-300)) /
                                      std::log(initial / limits.residual * 1.0000001),
                                  0.0, 1.0));
  }
  report.converged = settled || report.relativeResidual <= limits.residual;
  return settled;
}

} // namespace mrf
} // namespace pcl
