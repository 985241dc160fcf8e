#include "multigrid.h"

#include "linear_system.h"
#include "plane_kernels.h"

#include <pcl/surface/mrf/exceptions.h>

#include <cmath>

namespace pcl {
namespace mrf {
namespace {

/// Unknowns that are solved densely; the factor of this many takes a few milliseconds.
constexpr std::int64_t denseUnknowns = 400;

/// A smaller residual than this share of the last restart's is what a restart must bring to be worth it: beneath the
/// precision of Real nothing is gained.
constexpr double restartGain = .5;

/// RMS of p, in units, over the observed voxels closer than 2 units to the zero level of d: what a step changes of the
/// surface. Where nothing is observed near an open border, sheets creep for a hundred steps that data never decide, and
/// that no other part of the surface feels; hole fillings settle with the data around them.
template <typename Real>
double changeNearZeroLevel(const std::vector<Real>& d, const std::vector<Real>& p, const std::vector<Real>& dataWeights,
                           double unit, Execution& execution)
{
  const auto limit = static_cast<Real>(2 * unit);
  const auto count = static_cast<std::int64_t>(d.size());
  const auto sumNear = [&](const auto& value) {
    return execution.sum(count, sumGrain, [&](std::int64_t begin, std::int64_t end) {
      double sum = 0;
      for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
        if (dataWeights[i] > 0 && std::abs(d[i]) < limit)
          sum += value(static_cast<double>(p[i]) / unit);
      return sum;
    });
  };
  const double voxels = sumNear([](double) { return 1.0; });
  return voxels > 0 ? std::sqrt(sumNear([](double change) { return change * change; }) / voxels) : 0;
}

/// y += a x over whole vectors.
template <typename Real>
void addScaled(Real a, const std::vector<Real>& x, std::vector<Real>& y, Execution& execution)
{
  execution.forRange(static_cast<std::int64_t>(x.size()), sumGrain, [&](std::int64_t begin, std::int64_t end) {
    kernels::addScaled(end - begin, a, x.data() + begin, y.data() + begin);
  });
}

} // namespace

/// For k = 3 measured on grids of 0.2 to 1.6 million voxels: a third less work to 1e-4 than with 8, a tenth less than
/// with 7 or 14.
int smootherDegree(const SolverOptions& options, Prior prior)
{
  if (options.smootherDegree > 0)
    return options.smootherDegree;
  return prior == Prior::membrane ? 2 : prior == Prior::thinPlate ? 5 : 10;
}

template <typename Real>
MultigridPreconditioner<Real>::MultigridPreconditioner(const LinearSystem<Real>& system, int degree,
                                                       Execution& execution)
{
  levels_.push_back(std::make_unique<Level>());
  levels_.back()->system = &system;
  for (;;) {
    Level& level = *levels_.back();
    const GridSize size = level.system->size();
    const GridSize coarseSize = size.coarsened();
    if (size.count() <= denseUnknowns || coarseSize == size)
      break;
    level.smoother.emplace_back(*level.system, degree, execution);
    level.before.resize(static_cast<std::size_t>(size.count()));
    level.after.resize(static_cast<std::size_t>(size.count()));

    auto coarse = std::make_unique<Level>();
    const PriorOperator<Real>& prior = level.system->prior;
    coarse->own.prior.size = coarseSize;
    coarse->own.prior.prior = prior.prior;
    if (!prior.voxelWeights.empty())
      coarse->own.prior.voxelWeights = meanOfChildren(size, prior.voxelWeights, Real(1));
    coarse->own.data = level.system->data->coarsened(prior.prior, execution);
    coarse->system = &coarse->own;
    coarse->rightHandSide.resize(static_cast<std::size_t>(coarseSize.count()));
    levels_.push_back(std::move(coarse));
  }
  levels_.back()->after.resize(static_cast<std::size_t>(levels_.back()->system->size().count()));
  factoriseCoarsest();
}

template <typename Real>
void MultigridPreconditioner<Real>::factoriseCoarsest()
{
  const LinearSystem<Real>& system = *levels_.back()->system;
  Eigen::MatrixXd matrix = Eigen::MatrixXd(systemMatrix(system));
  // Where the data weigh next to nothing the constants are lost to rounding; this much keeps the factor definite and is
  // invisible otherwise.
  const double shift = 1e-11 * std::pow(12.0, order(system.prior.prior));
  matrix.diagonal().array() += shift;
  coarsest_.compute(matrix);
  if (coarsest_.info() != Eigen::Success)
    throw SolverFailure("multigrid: the matrix of the coarsest grid is not positive definite");
}

template <typename Real>
const std::vector<Real>& MultigridPreconditioner<Real>::apply(const std::vector<Real>& r, Execution& execution)
{
  return cycle(0, r.data(), execution);
}

template <typename Real>
std::vector<Real>& MultigridPreconditioner<Real>::spare()
{
  std::vector<Real>& before = levels_.front()->before;
  before.resize(levels_.front()->after.size()); // empty where the finest grid is solved densely
  return before;
}

template <typename Real>
const std::vector<Real>& MultigridPreconditioner<Real>::cycle(std::size_t index, const Real* b, Execution& execution)
{
  Level& level = *levels_[index];
  if (index + 1 == levels_.size()) {
    const auto count = static_cast<Eigen::Index>(level.after.size());
    Eigen::VectorXd solution =
        Eigen::Map<const Eigen::Matrix<Real, Eigen::Dynamic, 1>>(b, count).template cast<double>();
    coarsest_.solveInPlace(solution);
    Eigen::Map<Eigen::Matrix<Real, Eigen::Dynamic, 1>>(level.after.data(), count) = solution.template cast<Real>();
    return level.after;
  }
  Level& coarse = *levels_[index + 1];
  Smoother<Real>& smoother = level.smoother.front();
  smoother.smoothFromZero(b, level.before.data(), level.after.data(), execution);
  smoother.restrictTo(level.after.data(), coarse.rightHandSide.data(), execution);
  const std::vector<Real>& correction = cycle(index + 1, coarse.rightHandSide.data(), execution);
  smoother.smoothCorrected(b, level.before.data(), correction.data(), level.after.data(), execution);
  return level.after;
}

template <typename Real>
double MultigridPreconditioner<Real>::predictedBytes(const GridSize& size, Prior prior, bool weighted, bool pointwise,
                                                     int degree, int threads)
{
  double bytes = 0;
  bool isFinest = true;
  for (GridSize grid = size;; grid = grid.coarsened(), isFinest = false) {
    const double count = static_cast<double>(grid.count());
    if (!isFinest) // right-hand side, data (of points its own right-hand side, too), weights
      bytes += sizeof(Real) * count * (2 + (pointwise ? 1 : 0) + (weighted ? 1 : 0));
    if (grid.count() <= denseUnknowns || grid.coarsened() == grid)
      return bytes + (sizeof(double) * count + sizeof(Real)) * count;
    bytes += 2 * sizeof(Real) * count + Smoother<Real>::predictedBytes(grid, prior, degree, threads);
  }
}

template <typename Real>
SolveReport solveMultigrid(const LinearSystem<Real>& system, const SolverOptions& options, double unit,
                           std::vector<Real>& d, Execution& execution)
{
  SolveReport report;
  report.method = SolverMethod::multigrid;
  const std::vector<Real>& b = system.data->rightHandSide();
  const int maxIterations = options.maxIterations > 0 ? options.maxIterations : 100;
  const int degree = smootherDegree(options, system.prior.prior);
  const double norm = std::sqrt(dotProduct(b, b, execution));
  if (norm == 0) {
    std::fill(d.begin(), d.end(), Real(0));
    report.converged = true;
    return report;
  }

  MultigridPreconditioner<Real> preconditioner(system, degree, execution);
  std::vector<Real> r(d.size()), p(d.size());
  std::vector<Real>& product = preconditioner.spare();
  const auto trueResidual = [&] {
    return std::sqrt(systemResidual(system, b.data(), d.data(), r.data(), execution)) / norm;
  };

  report.relativeResidual = trueResidual();
  double restarted = report.relativeResidual;
  const double initial = std::max(restarted, options.residualTolerance);
  bool fresh = true;
  double gamma = 0;
  bool settled = false;
  while (!settled && report.relativeResidual > options.residualTolerance && report.iterations < maxIterations) {
    const std::vector<Real>& z = preconditioner.apply(r, execution);
    const double next = dotProduct(r, z, execution);
    const Real beta = fresh ? Real(0) : static_cast<Real>(next / gamma);
    gamma = next;
    if (fresh)
      p = z;
    else
      execution.forRange(static_cast<std::int64_t>(p.size()), sumGrain, [&](std::int64_t begin, std::int64_t end) {
        kernels::scaleAndAdd(end - begin, beta, z.data() + begin, p.data() + begin);
      });
    fresh = false;

    const double curvature = applySystemAndDot(system, p.data(), product.data(), execution);
    if (!(std::isfinite(gamma) && std::isfinite(curvature)))
      throw SolverFailure("multigrid: the iteration broke down with values that are not finite");
    if (!(curvature > 0 && gamma > 0))
      break; // nothing but rounding is left
    const Real step = static_cast<Real>(gamma / curvature);
    addScaled(step, p, d, execution);
    addScaled(-step, product, r, execution);

    ++report.iterations;
    settled =
        options.changeTolerance > 0 &&
        std::abs(step) * changeNearZeroLevel(d, p, system.data->diagonal(), unit, execution) < options.changeTolerance;
    report.relativeResidual = std::sqrt(dotProduct(r, r, execution)) / norm;
    if (report.relativeResidual <= options.residualTolerance) {
      // The recursion drifts from the residual by rounding: what counts is the residual itself.
      report.relativeResidual = trueResidual();
      if (report.relativeResidual > options.residualTolerance) {
        if (report.relativeResidual > restartGain * restarted) {
          report.history.push_back(report.relativeResidual);
          break;
        }
        restarted = report.relativeResidual;
        fresh = true;
      }
    }
    report.history.push_back(report.relativeResidual);
    execution.progress(std::clamp(std::log(initial / std::max(report.relativeResidual, 1e-300)) /
                                      std::log(initial / options.residualTolerance * 1.0000001),
                                  0.0, 1.0));
  }
  report.relativeResidual = trueResidual();
  report.converged = settled || report.relativeResidual <= options.residualTolerance;
  return report;
}

#define MRF_INSTANTIATE(Real)                                                                                          \
  template class MultigridPreconditioner<Real>;                                                                        \
  template SolveReport solveMultigrid(const LinearSystem<Real>&, const SolverOptions&, double, std::vector<Real>&,     \
                                      Execution&);

MRF_INSTANTIATE(float)
MRF_INSTANTIATE(double)
#undef MRF_INSTANTIATE

} // namespace mrf
} // namespace pcl
