// SPDX-License-Identifier: BSD-3-Clause
#include "solver/grid_solver.h"

#include "base/loops.h"
#include "base/vector_kernels.h"
#include "field/prior.h"
#include "solver/v_cycle.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>

namespace pcl::mrf {
namespace {

/// Planes per piece of the passes without stencils.
constexpr int grainPlanes = 4;

/// Another restart is made if the last one left at most this part of the squared residual. Beyond single precision
/// nothing is gained.
constexpr double restartGain = .25;

/// Several steps of conjugate gradients need equal degrees before and after the coarse correction, and a well solved
/// coarsest grid. A single one leaves the field as the last smoothing does: half the degree is enough for the others.
SmootherDegrees degreesOf(int degree, int cycles)
{
  const int half = (degree + 1) / 2;
  return cycles == 1 ? SmootherDegrees{half, degree, half} : SmootherDegrees{degree, degree, 2 * degree};
}

/// Clears the residual at unobserved voxels from which L^k reaches beyond the rim of the band: the guess may have kinks
/// out there, and the correction must not react to them.
void clearNearRim(const GridOperator& system, int order, PackedValues& r, Execution& execution)
{
  const VoxelSet& band = system.voxels();
  const VoxelSet inside = eroded(band, order, execution);
  forEach<int>(execution, band.size().z, grainPlanes, [&](int z) {
    std::vector<std::uint8_t> isInside(band.planeCount(z), 0);
    const std::int64_t first = band.planeFirst(z);
    forEachPair(inside, band, z, [&](std::int64_t, std::int64_t voxel, std::int64_t count) {
      std::fill_n(isInside.begin() + (voxel - first), count, std::uint8_t{1});
    });
    for (std::int64_t voxel = first; voxel < band.planeFirst(z + 1); ++voxel)
      if (!isInside[voxel - first] && !system.isObserved(voxel))
        r[voxel] = 0;
  });
}

/// A sum of squares and the number of its terms.
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
  double residual = 0;         ///< sum of the squares of r
  SquareSum observed, filling; ///< of the step at voxels near the zero level: at observed ones, and at others
};

/// When the iteration ends.
struct StepLimits {
  int maxIterations;
  double residual; ///< the iteration ends at this residual, relative to `scale`
  double change;   ///< or below this RMS change at observed voxels near the zero level, voxel sides; 0: not by it
  /// A small change counts only if the relative residual is below this: between sparse points the field still changes
  /// much after the voxels at the points have settled.
  double residualOfChange;
  double unit;  ///< length of a voxel side in the unit of the field
  double scale; ///< norm that residuals are divided by
};

/// The change by all further steps together if each changes `ratio` times as much as the one before it.
double remainingChange(double lastChange, double ratio)
{
  constexpr double largestRatio = .9; // the residual of conjugate gradients may grow for a while
  const double bounded = std::min(ratio, largestRatio);
  return lastChange * bounded / (1 - bounded);
}

/// Conjugate gradients on a level, and their vectors.
class LevelSystem {
public:
  LevelSystem(VCycle& cycle, const VoxelSet& support, PackedValues& r, double near, float* values, Execution& execution)
      : cycle_(cycle), system_(cycle.finest()), voxels_(system_.voxels()), support_(support), r_(r),
        near_(static_cast<float>(near)), values_(values), parts_(voxels_.size().z), execution_(execution)
  {}

  /// \param squaredResidual of the guess \param tile set to each step, or null
  /// \param report added to; its iterations count for the limit
  /// \return true if a step changed less than the limit
  /// \throw SolverFailure if values are not finite
  bool iterate(const StepLimits& limits, double squaredResidual, TileStep* tile, SolveReport& report)
  {
    report.relativeResidual = std::sqrt(squaredResidual) / limits.scale;
    double before = report.relativeResidual, beforeThat = before;
    const double initial = std::max(report.relativeResidual, limits.residual);
    double gamma = 0;
    bool settled = false, isFirst = true;
    while (!settled && report.relativeResidual > limits.residual && report.iterations < limits.maxIterations) {
      const double next = precondition();
      const double curvature = multiply(isFirst ? 0 : next / gamma);
      gamma = next;
      if (!(std::isfinite(gamma) && std::isfinite(curvature)))
        throw SolverFailure("multigrid: the iteration broke down with values that are not finite");
      if (!(curvature > 0 && gamma > 0))
        break; // nothing but rounding is left
      if (tile)
        describe(gamma / curvature, *tile);
      const StepSums sums = step(gamma / curvature);
      ++report.iterations;
      report.relativeResidual = std::sqrt(sums.residual) / limits.scale;
      const double observed = sums.observed.rms() / limits.unit, filling = sums.filling.rms() / limits.unit;
      settled =
          sums.observed.count > 0 && observed < limits.change && report.relativeResidual < limits.residualOfChange;
      // Single steps are uneven: from the second on the geometric mean of two is taken.
      const double ratio = isFirst ? report.relativeResidual / before : std::sqrt(report.relativeResidual / beforeThat);
      report.remainingChange = remainingChange(observed, ratio);
      report.remainingChangeOfFillings = remainingChange(filling, ratio);
      beforeThat = before;
      before = report.relativeResidual;
      isFirst = false;
      report.history.push_back(report.relativeResidual);
      execution_.progress(std::clamp(std::log(initial / std::max(report.relativeResidual, 1e-300)) /
                                         std::log(initial / limits.residual * 1.0000001),
                                     0.0, 1.0));
    }
    report.converged = settled || report.relativeResidual <= limits.residual;
    return settled;
  }

private:
  /// z = M r. \return rᵀz
  double precondition()
  {
    if (z_ && p_.empty())
      p_ = *z_; // the preconditioner is about to overwrite z
    z_ = &cycle_.apply(r_.data(), execution_);
    return dotProduct(r_, *z_, execution_);
  }

  /// p = z + β p and A p. \return pᵀAp
  double multiply(double beta)
  {
    direction_ = p_.empty() ? z_ : &p_;
    if (!p_.empty())
      scaleAndAdd(static_cast<float>(beta), *z_, p_, execution_);
    PackedValues& product = cycle_.spare();
    system_.multiply(voxels_, direction_->data(), nullptr, product.data(), cycle_.scratch(), execution_);
    return dotProduct(*direction_, product, execution_);
  }

  void describe(double length, TileStep& tile)
  {
    const std::int64_t begin = voxels_.planeFirst(tile.begin), count = voxels_.planeFirst(tile.end) - begin;
    tile.length = length;
    tile.decrease = kernels::dot(count, r_.data() + begin, z_->data() + begin);
    tile.curvature = kernels::dot(count, direction_->data() + begin, cycle_.spare().data() + begin);
  }

  /// d += length · p, r −= length · A p
  StepSums step(double length)
  {
    const auto factor = static_cast<float>(length);
    forEach<int>(execution_, voxels_.size().z, grainPlanes,
                 [&](int plane) { parts_[plane] = stepOnPlane(factor, plane); });
    StepSums total;
    for (const StepSums& part : parts_) {
      total.residual += part.residual;
      total.observed.add(part.observed);
      total.filling.add(part.filling);
    }
    return total;
  }

  StepSums stepOnPlane(float length, int plane)
  {
    const PackedValues &direction = *direction_, &product = cycle_.spare();
    StepSums sums;
    forEachPair(voxels_, support_, plane, [&](std::int64_t inner, std::int64_t outer, std::int64_t count) {
      float *const d = values_ + outer, *const r = r_.data() + inner;
      const float *const p = direction.data() + inner, *const ap = product.data() + inner;
      for (std::int64_t i = 0; i < count; ++i)
        d[i] += length * p[i];
      for (std::int64_t i = 0; i < count; ++i)
        r[i] -= length * ap[i];
      sums.residual += kernels::dot(count, r, r);
      for (std::int64_t i = 0; i < count; ++i)
        if (std::abs(d[i]) < near_)
          (system_.isObserved(inner + i) ? sums.observed : sums.filling)
              .add(static_cast<double>(length) * static_cast<double>(p[i]));
    });
    return sums;
  }

  VCycle& cycle_;
  GridOperator& system_;
  const VoxelSet &voxels_, &support_;
  PackedValues& r_;
  PackedValues p_; ///< from the second step on
  const PackedValues *z_ = nullptr, *direction_ = nullptr;
  float near_;
  float* values_;
  std::vector<StepSums> parts_; ///< by planes
  Execution& execution_;
};

} // namespace

int smootherDegree(const SolverOptions& options, Prior prior, bool isWhole)
{
  return options.smootherDegree > 0 ? options.smootherDegree : priorConstants(prior, isWhole).degree;
}

SolveReport solveOnGrids(const GridSystem& posed, const LevelPlan& plan, const SolverOptions& options, double unit,
                         float* values, Execution& execution)
{
  const auto& [grids, prior, support, rightHandSide, tile] = posed;
  SolveReport report;
  report.method = SolverMethod::multigrid;
  const bool isWhole = grids.front().isWhole;
  const int steps = options.maxIterations > 0 ? options.maxIterations : plan.steps;
  VCycle cycle(grids, priorConstants(prior, isWhole), degreesOf(smootherDegree(options, prior, isWhole), steps),
               plan.threads, execution);
  GridOperator& system = cycle.finest();

  const auto setRightHandSide = [&](PackedValues& b) {
    if (posed.rightHandSide)
      b = *posed.rightHandSide;
    else
      sumRightHandSide(grids.front(), nullptr, b, execution);
  };
  PackedValues r;
  setRightHandSide(r);
  const double norm = std::sqrt(dotProduct(r, r, execution));
  system.multiply(support, values, r.data(), r.data(), cycle.scratch(), execution);
  if (!isWhole)
    clearNearRim(system, order(prior), r, execution);
  double squared = dotProduct(r, r, execution);
  const double scale = norm > 0 ? norm : std::sqrt(squared);
  if (!std::isfinite(squared + norm))
    throw SolverFailure("multigrid: the guess or the data have values that are not finite");
  if (scale == 0) {
    report.converged = true;
    return report;
  }
  const StepLimits limits{
      steps, options.residualTolerance, options.changeTolerance, isWhole ? residualOfChange : 1, unit, scale};
  for (double before = squared;; before = squared) {
    LevelSystem level(cycle, support, r, 2 * unit, values, execution);
    const bool settled = level.iterate(limits, before, tile, report);
    if (!isWhole)
      report.converged = report.converged || report.remainingChange <= changeLeftInBands;
    if (!isWhole || settled)
      return report;
    // By rounding r has drifted from the true residual, which is computed here.
    setRightHandSide(r);
    system.multiply(support, values, r.data(), r.data(), cycle.scratch(), execution);
    squared = dotProduct(r, r, execution);
    report.relativeResidual = std::sqrt(squared) / scale;
    const bool wasFinished = report.converged;
    report.converged = report.relativeResidual <= options.residualTolerance;
    if (report.converged || !wasFinished || squared > restartGain * before)
      return report;
  }
}

SolveReport solveWholeGrids(const std::vector<SolverGrid>& grids, Prior prior, const SolverOptions& options,
                            double unit, std::vector<float>& values, Execution& execution)
{
  LevelPlan plan{wholeLevelSteps};
  plan.threads = execution.threads();
  return solveOnGrids({grids, prior, grids.front().voxels}, plan, options, unit, values.data(), execution);
}

} // namespace pcl::mrf
