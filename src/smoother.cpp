#include "smoother.h"

#include "linear_system.h"
#include "prior_pipeline.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pcl {
namespace mrf {
namespace {

/// Planes that one step of a sweep advances before the next one follows: enough to reuse the powers of L while they are
/// in the second-level cache.
constexpr int blockPlanes = 8;

/// What the planes of one sweep in flight may take of the last-level cache.
constexpr std::size_t windowBytes = std::size_t{16} << 20;

/// Fine voxels around a coarse one and their shares of it along one axis: Pᵀ in one dimension.
template <typename Real>
struct Children {
  std::array<int, 4> index;
  std::array<Real, 4> weight;

  Children(int coarse, int fineSize)
  {
    const int last = (fineSize + 1) / 2 - 1;
    // Where a voxel's second parent lies outside, its first one takes the whole weight.
    weight = {Real(.25), coarse == 0 ? Real(1) : Real(.75), coarse == last ? Real(1) : Real(.75), Real(.25)};
    for (int n = 0; n < 4; ++n) {
      index[static_cast<std::size_t>(n)] = 2 * coarse - 1 + n;
      if (2 * coarse - 1 + n < 0 || 2 * coarse - 1 + n >= fineSize) {
        index[static_cast<std::size_t>(n)] = 2 * coarse;
        weight[static_cast<std::size_t>(n)] = 0;
      }
    }
  }
};

/// The two coarse voxels that a fine one is interpolated from along one axis.
struct Parents {
  int near, far;
  Parents(int fine, int fineSize)
      : near(fine / 2), far(std::clamp(fine % 2 == 0 ? near - 1 : near + 1, 0, (fineSize + 1) / 2 - 1))
  {}
};

/// D⁻¹, D = c_k + diag C, or with voxel weights the row sums of |P| in place of c_k, scaled to be the same for v = 1.
template <typename Real>
std::vector<Real> inverseScaling(const LinearSystem<Real>& system, Execution& execution)
{
  const PriorOperator<Real>& prior = system.prior;
  const Real centre = static_cast<Real>(centreCoefficient(prior.prior));
  const std::vector<Real>& diagonal = system.data->diagonal();
  std::vector<Real> result(diagonal.size(), centre);
  if (!prior.voxelWeights.empty()) {
    // |L| x is at most S x = 12 x − L x, so the row sums are below S v, 12 S v and 12 S S v.
    const PriorOperator<Real> laplacian{prior.size, Prior::membrane, {}};
    std::vector<Real> product(diagonal.size());
    result = prior.voxelWeights;
    const int sums = order(prior.prior) == 3 ? 2 : 1;
    for (int n = 0; n < sums; ++n) {
      apply(laplacian, result.data(), product.data(), execution);
      for (std::size_t i = 0; i < result.size(); ++i)
        result[i] = std::max(result[i] - product[i] / 12, Real(0));
    }
    for (Real& value : result)
      value *= centre;
  }
  for (std::size_t i = 0; i < result.size(); ++i) {
    const Real d = result[i] + diagonal[i];
    result[i] = d > 0 ? 1 / d : Real(0);
  }
  return result;
}

template <typename Real>
SlabPlan planSlabs(const GridSize& size, int order, int threads)
{
  SlabPlan plan{slabThickness(size, threads), 0};
  // Per step: k + 1 planes of five arrays, and the powers of L.
  const std::size_t stepBytes = static_cast<std::size_t>(size.planeCount()) * sizeof(Real) *
                                static_cast<std::size_t>(5 * (order + 1) + 3 * order - 1);
  plan.stepsPerSweep = std::max(1, static_cast<int>(std::min<std::size_t>(windowBytes / stepBytes, 100)));
  if (plan.thickness < size.z)
    plan.stepsPerSweep = std::max(1, std::min(plan.stepsPerSweep, plan.thickness / (2 * order)));
  return plan;
}

} // namespace

/// What a slab keeps from sweep to sweep, so that nothing is allocated while solving.
template <typename Real>
struct Smoother<Real>::Workspace {
  std::vector<PriorPipeline<Real>> pipelines;
  std::vector<Real> planes;
};

template <typename Real>
Smoother<Real>::Smoother(const LinearSystem<Real>& system, int degree, Execution& execution)
    : system_(&system), degree_(degree), order_(order(system.prior.prior)),
      plan_(planSlabs<Real>(system.size(), order_, execution.threads())), inverseD_(inverseScaling(system, execution))
{
  const double largest = std::pow(12.0, order_) / centreCoefficient(system.prior.prior);
  bound_ = static_cast<Real>(1.01 * std::max(largest, static_cast<double>(system.data->spectralBound())));

  workspaces_.resize(static_cast<std::size_t>((system.size().z + plan_.thickness - 1) / plan_.thickness));
}

template <typename Real>
double Smoother<Real>::predictedBytes(const GridSize& size, Prior prior, int degree, int threads)
{
  const int k = order(prior);
  const SlabPlan plan = planSlabs<Real>(size, k, threads);
  const int slabs = (size.z + plan.thickness - 1) / plan.thickness;
  const int sweeps = std::max(1, (degree + plan.stepsPerSweep - 1) / plan.stepsPerSweep),
            steps = (degree + sweeps - 1) / sweeps, products = steps + (sweeps > 1 ? 1 : 0);
  const int halo = std::min(size.z - plan.thickness, 2 * k * products);
  const int ring = std::min(plan.thickness + halo, blockPlanes + steps * (k + 1) + 2);
  const double planes = halo + ring + 2 * products + .25 + 3. * products * (k - 1);
  const double arrays = sweeps > 1 ? 4 : 1;
  return static_cast<double>(sizeof(Real)) *
         (arrays * static_cast<double>(size.count()) + planes * slabs * static_cast<double>(size.planeCount()));
}

template <typename Real>
Smoother<Real>::~Smoother() = default;

template <typename Real>
Smoother<Real>::Smoother(Smoother&&) noexcept = default;

template <typename Real>
void Smoother<Real>::smoothFromZero(const Real* b, Real* x, Real* residual, Execution& execution)
{
  Sweep whole;
  whole.source = Source::zero;
  whole.b = b;
  whole.out = x;
  whole.residual = residual;
  smooth(whole, execution);
}

template <typename Real>
void Smoother<Real>::smoothCorrected(const Real* b, const Real* x, const Real* coarse, Real* out, Execution& execution)
{
  Sweep whole;
  whole.source = Source::corrected;
  whole.b = b;
  whole.x = x;
  whole.coarse = coarse;
  whole.out = out;
  smooth(whole, execution);
}

template <typename Real>
void Smoother<Real>::smooth(const Sweep& whole, Execution& execution)
{
  // The residual costs as much as a step; the first step from zero costs nothing.
  const int costs = degree_ + (whole.residual ? 1 : 0) - (whole.source == Source::zero ? 1 : 0);
  const int sweeps = std::max(1, (costs + plan_.stepsPerSweep - 1) / plan_.stepsPerSweep);
  const int steps = (degree_ + sweeps - 1) / sweeps;
  if (sweeps > 1) {
    iterate_.resize(inverseD_.size());
    for (auto& direction : directions_)
      direction.resize(inverseD_.size());
  }
  const int used = (degree_ + steps - 1) / steps;
  Sweep sweep = whole;
  for (int n = 0; n < used; ++n) {
    const bool isLast = n + 1 == used;
    if (n > 0) {
      sweep.source = Source::iterate;
      sweep.x = sweep.out;
      sweep.directionIn = sweep.directionOut;
    }
    sweep.first = n * steps + 1;
    sweep.last = std::min(degree_, sweep.first + steps - 1);
    // Slabs read planes of their neighbours, so a sweep never writes the array it reads.
    sweep.out = (used - 1 - n) % 2 == 0 ? whole.out : iterate_.data();
    sweep.directionOut = isLast ? nullptr : directions_[n % 2].data();
    sweep.residual = isLast ? whole.residual : nullptr;
    execution.forRange(system_->size().z, plan_.thickness, [&](std::int64_t begin, std::int64_t end) {
      runSlab(sweep, static_cast<int>(begin), static_cast<int>(end),
              workspaces_[static_cast<std::size_t>(begin / plan_.thickness)]);
    });
    execution.poll(); // on ten million voxels a V-cycle takes seconds
  }
}

template <typename Real>
void Smoother<Real>::runSlab(const Sweep& sweep, int zBegin, int zEnd, Workspace& workspace) const
{
  const GridSize size = system_->size();
  const std::int64_t plane = size.planeCount();
  const int k = order_;
  const int steps = sweep.last - sweep.first + 1 - (sweep.source == Source::zero ? 1 : 0);
  const int products = steps + (sweep.residual ? 1 : 0);
  // After `step` steps the iterate is known on the planes [low(step), high(step)).
  const auto low = [&](int step) { return std::max(0, zBegin - k * (products - step)); };
  const auto high = [&](int step) { return std::min(size.z, zEnd + k * (products - step)); };

  const int haloBelow = zBegin - low(0), halo = haloBelow + high(0) - zEnd;
  const int ring = std::min(high(0) - low(0), blockPlanes + steps * (k + 1) + 2);
  const GridSize coarse = size.coarsened();
  const std::int64_t prolongation = sweep.source == Source::corrected ? coarse.planeCount() + coarse.x : 0;
  const auto needed = static_cast<std::size_t>(plane * (halo + ring + 2 * products) + prolongation);
  if (workspace.planes.size() < needed) {
    workspace.planes = std::vector<Real>(); // growing keeps up to twice as much, and both while it copies
    workspace.planes.resize(needed);
  }
  while (static_cast<int>(workspace.pipelines.size()) < products)
    workspace.pipelines.emplace_back(system_->prior);

  Real* const halos = workspace.planes.data();
  Real* const directions = halos + plane * halo;
  Real* const productPlanes = directions + plane * ring;
  const auto x = [&](int z) -> Real* {
    return z < zBegin ? halos + plane * (z - low(0))
           : z < zEnd ? sweep.out + plane * z
                      : halos + plane * (haloBelow + z - zEnd);
  };
  const auto direction = [&](int z) { return directions + plane * (z % ring); };
  const auto productOf = [&](int step, int z) { return productPlanes + plane * (2 * (step - 1) + z % 2); };
  const auto computeProduct = [&](int step, int z) {
    Real* product = productOf(step, z);
    workspace.pipelines[static_cast<std::size_t>(step - 1)].produce(z, x, product);
    system_->data->addPlaneProduct(z, x(std::max(z - 1, 0)), x(z), x(std::min(z + 1, size.z - 1)), product);
  };

  const auto gain = [&](int i) { return Real(8 * i - 4) / (Real(2 * i + 1) * bound_); };
  const auto keepDirection = [&](int z) {
    if (sweep.directionOut && z >= zBegin && z < zEnd)
      std::copy_n(direction(z), plane, sweep.directionOut + plane * z);
  };
  const auto start = [&](int z) {
    const std::int64_t offset = plane * z;
    if (sweep.source == Source::zero) {
      kernels::smoothZero(plane, gain(1), sweep.b + offset, inverseD_.data() + offset, direction(z), x(z));
    } else if (sweep.source == Source::corrected) {
      prolongPlane(z, sweep.coarse, sweep.x + offset, x(z), productPlanes + plane * 2 * products);
    } else {
      std::copy_n(sweep.x + offset, plane, x(z));
      std::copy_n(sweep.directionIn + offset, plane, direction(z));
    }
    if (steps == 0)
      keepDirection(z);
  };
  const auto update = [&](int step, int z) {
    const int i = sweep.last - steps + step;
    const Real* b = sweep.b + plane * z;
    const Real* inverseD = inverseD_.data() + plane * z;
    if (i == 1)
      kernels::smoothFirst(plane, gain(i), productOf(step, z), b, inverseD, direction(z), x(z));
    else
      kernels::smooth(plane, Real(2 * i - 3) / Real(2 * i + 1), gain(i), productOf(step, z), b, inverseD, direction(z),
                      x(z));
    if (step == steps)
      keepDirection(z);
  };

  std::vector<int> produced(static_cast<std::size_t>(products) + 1); // planes of each step's product: up to here
  for (int step = 1; step <= products; ++step) {
    produced[static_cast<std::size_t>(step)] = low(step);
    workspace.pipelines[static_cast<std::size_t>(step - 1)].restart(low(step));
  }
  int& started = produced[0];
  started = low(0);
  bool finished = false;
  while (!finished) {
    for (const int end = std::min(started + blockPlanes, high(0)); started < end; ++started)
      start(started);
    int known = started; // planes of the previous step's iterate: up to here
    for (int step = 1; step <= products; ++step) {
      const bool toTheEnd = known == high(step - 1);
      const int end = toTheEnd ? high(step) : known - k;
      int& z = produced[static_cast<std::size_t>(step)];
      const bool wasDone = z == high(step);
      if (step > steps) {
        for (; z < end; ++z) {
          computeProduct(step, z);
          kernels::residual(plane, productOf(step, z), sweep.b + plane * z, sweep.residual + plane * z);
        }
        known = z;
        continue;
      }
      // A plane is updated only after the product of the next one, which still reads its old values.
      for (; z < end; ++z) {
        computeProduct(step, z);
        if (z > low(step))
          update(step, z - 1);
      }
      if (toTheEnd && !wasDone)
        update(step, z - 1);
      known = toTheEnd ? z : std::max(z - 1, low(step));
    }
    finished = known == high(products);
  }
}

template <typename Real>
void Smoother<Real>::prolongPlane(int z, const Real* coarse, const Real* in, Real* out, Real* scratch) const
{
  const GridSize size = system_->size();
  const GridSize coarseSize = size.coarsened();
  const std::int64_t coarsePlane = coarseSize.planeCount();
  const Parents planes(z, size.z);
  kernels::blend(coarsePlane, coarse + coarsePlane * planes.near, coarse + coarsePlane * planes.far, scratch);
  Real* row = scratch + coarsePlane;
  for (int y = 0; y < size.y; ++y) {
    const Parents rows(y, size.y);
    const std::int64_t width = coarseSize.x;
    kernels::blend(width, scratch + width * rows.near, scratch + width * rows.far, row);
    kernels::prolongRow(size.x, row, in + std::int64_t{size.x} * y, out + std::int64_t{size.x} * y);
  }
}

template <typename Real>
void Smoother<Real>::restrictTo(const Real* fine, Real* coarse, Execution& execution) const
{
  const GridSize size = system_->size();
  const GridSize coarseSize = size.coarsened();
  const std::int64_t plane = size.planeCount();
  const int children = (size.x > 1 ? 2 : 1) * (size.y > 1 ? 2 : 1) * (size.z > 1 ? 2 : 1);
  const Real scale = coarseDamping<Real>(order_, system_->data->isDiagonal()) * static_cast<Real>(1 << (2 * order_)) /
                     static_cast<Real>(children);
  execution.forRange(coarseSize.z, (plan_.thickness + 1) / 2, [&](std::int64_t begin, std::int64_t end) {
    std::vector<Real> inZ(static_cast<std::size_t>(plane)), inY(static_cast<std::size_t>(size.x));
    for (std::int64_t z = begin; z < end; ++z) {
      const Children<Real> planes(static_cast<int>(z), size.z);
      const auto planeOf = [&](std::size_t n) { return fine + plane * planes.index[n]; };
      kernels::combine(plane, planeOf(0), planes.weight[0], planeOf(1), planes.weight[1], planeOf(2), planes.weight[2],
                       planeOf(3), planes.weight[3], inZ.data());
      for (int y = 0; y < coarseSize.y; ++y) {
        const Children<Real> rows(y, size.y);
        const auto rowOf = [&](std::size_t n) { return inZ.data() + std::int64_t{size.x} * rows.index[n]; };
        kernels::combine(size.x, rowOf(0), rows.weight[0], rowOf(1), rows.weight[1], rowOf(2), rows.weight[2], rowOf(3),
                         rows.weight[3], inY.data());
        kernels::restrictRow(size.x, scale, inY.data(), coarse + coarseSize.index(0, y, static_cast<int>(z)));
      }
    }
  });
}

template class Smoother<float>;
template class Smoother<double>;

} // namespace mrf
} // namespace pcl
