// SPDX-License-Identifier: BSD-3-Clause
#include "solver/multigrid.h"

#include "base/vector_kernels.h"
#include "field/prior.h"
#include "observation/observation.h"
#include "solver/grid_solver.h"
#include "solver/grids.h"
#include "solver/preconditioned_cg.h"
#include "solver/v_cycle.h"

#include <pcl/surface/mrf/report.h>

#include <algorithm>
#include <cmath>

namespace pcl {
namespace mrf {
namespace {

/// A system's grids, and what they refer to.
struct Hierarchy {
  std::vector<Lattice> lattices;
  LevelSamples samples;
  LevelObservation observation;
  std::vector<SolverGrid> grids;

  Hierarchy(const LinearSystem& system, Execution& execution)
  {
    lattices.push_back({system.size(), Eigen::Vector3d::Zero(), 1});
    addCoarserGrids(lattices);
    if (!system.isDiagonal()) {
      samples = LevelSamples(sortedByCells(system.samples, execution), lattices, execution);
      observation.samples = &samples;
      observation.weights = system.weights;
    } else {
      observeDiagonal(system);
    }
    grids = wholeGrids(lattices, lattices.size() - 1, observation, system.prior.kind, execution);
  }

private:
  /// Voxels with the confidences that give the system's weights.
  void observeDiagonal(const LinearSystem& system)
  {
    observation.prior.kind = system.prior.kind;
    observation.prior.beta = 1;
    observation.voxels.lattice = lattices.back();
    for (std::int64_t voxel = 0; voxel < system.size().count(); ++voxel)
      for (DataMatrix::InnerIterator entry(system.data, voxel); entry; ++entry) {
        const double w = entry.value() / centerCoefficient(system.prior.kind);
        observation.voxels.voxels.push_back(voxel);
        observation.voxels.confidences.push_back(static_cast<float>(w / (1 + w)));
        observation.voxels.distances.push_back(0);
      }
  }
};

/// The vectors of conjugate gradients on a plain system.
class PlainSystem {
public:
  PlainSystem(const LinearSystem& system, VCycle& cycle, double unit, std::vector<double>& d, Execution& execution)
      : system_(system), product_(system), cycle_(cycle), near_(2 * unit), d_(d), r_(d.size()), z_(d.size()),
        ap_(d.size()), single_(d.size()), execution_(execution)
  {}

  double residual() { return product_.residual(d_, r_, execution_); }

  double precondition()
  {
    std::copy(r_.begin(), r_.end(), single_.begin());
    const PackedValues& z = cycle_.apply(single_.data(), execution_);
    std::copy(z.begin(), z.end(), z_.begin());
    return dotProduct(r_, z_, execution_);
  }

  double multiply(double beta)
  {
    if (p_.empty())
      p_ = z_;
    else
      scaleAndAdd(beta, z_, p_, execution_);
    product_.apply(p_, ap_, execution_);
    return dotProduct(p_, ap_, execution_);
  }

  StepSums step(double length)
  {
    addScaled(length, p_, d_, execution_);
    addScaled(-length, ap_, r_, execution_);
    StepSums sums;
    sums.residual = dotProduct(r_, r_, execution_);
    const auto outer = system_.data.outerIndexPtr();
    for (std::size_t i = 0; i < d_.size(); ++i)
      if (std::abs(d_[i]) < near_)
        (outer[i + 1] > outer[i] ? sums.observed : sums.filling).add(length * p_[i]);
    return sums;
  }

private:
  const LinearSystem& system_;
  SystemProduct product_;
  VCycle& cycle_;
  double near_;
  std::vector<double>& d_;
  std::vector<double> r_, z_, p_, ap_;
  PackedValues single_;
  Execution& execution_;
};

} // namespace

SolveReport solveMultigrid(const LinearSystem& system, const SolverOptions& options, double unit,
                           std::vector<double>& d, Execution& execution)
{
  SolveReport report;
  report.method = SolverMethod::multigrid;
  const double norm = std::sqrt(dotProduct(system.rightHandSide, system.rightHandSide, execution));
  if (norm == 0) {
    std::fill(d.begin(), d.end(), 0.);
    report.converged = true;
    return report;
  }
  const Hierarchy hierarchy(system, execution);
  const Prior prior = system.prior.kind;
  const int degree = smootherDegree(options, prior, true);
  const int steps = options.maxIterations > 0 ? options.maxIterations : wholeLevelSteps;
  VCycle cycle(hierarchy.grids, priorConstants(prior), {degree, degree, 2 * degree}, execution.threads(), execution);
  PlainSystem plain(system, cycle, unit, d, execution);
  iterate(plain, {steps, options.residualTolerance, options.changeTolerance, residualOfChange, unit, norm},
          plain.residual(), report, execution);
  report.relativeResidual = std::sqrt(plain.residual()) / norm;
  return report;
}

} // namespace mrf
} // namespace pcl
