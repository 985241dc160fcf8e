// SPDX-License-Identifier: BSD-3-Clause
#include "solver/grid_operator.h"

#include "base/loops.h"
#include "solver/wavefront.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>

namespace pcl::mrf {
namespace {

/// Max bytes of the last-level cache for the windows of one sweep, counting the voxels of a mean plane. A few planes,
/// along flat parts of the surface, may not fit: that costs less than another sweep over all.
constexpr double windowBytes = 12 << 20;

/// Planes per piece of the passes without stencils.
constexpr int grainPlanes = 16;

/// Values per piece of the passes over packed values.
constexpr std::int64_t grainValues = 1 << 18;

constexpr int noPlane = std::numeric_limits<int>::min();

/// Steps of the smoother that one sweep takes. \param unknowns on the grid
int stepsPerSweep(const GridSize& size, double unknowns, int order, int slabs)
{
  const double planeBytes = std::floor(unknowns / size.z) * sizeof(float);
  const double stepBytes = planeBytes * (2 * (order + 1) + 3 * (order - 1) + 2);
  const int inCache = static_cast<int>(std::min(windowBytes / std::max(stepBytes, 1.), 100.));
  // Each step needs k planes more around a slab: with thin slabs most of the work would be done twice.
  const int inSlab = slabs > 1 ? size.z / slabs / (2 * order) : inCache;
  return std::max(1, std::min(inCache, inSlab));
}

/// The degrees of a whole level, whose planes are alike: four planes, for a single plane, the last, the first, others.
PackedValues degreesOfWhole(const VoxelSet& voxels, Execution& execution)
{
  const GridSize size{voxels.size().x, voxels.size().y, 1};
  const VoxelSet plane(size, execution, [&](int, MaskPlane& mask) { voxels.rasterize(voxels.bottom(), mask); });
  const PackedValues inPlane = degrees(plane, execution);
  PackedValues result;
  for (const float beside : {0.f, 1.f, 1.f, 2.f})
    std::transform(inPlane.begin(), inPlane.end(), std::back_inserter(result),
                   [=](float degree) { return degree + beside; });
  return result;
}

/// Calls layer(z, window of z, window of z + 1), which adds to the windows, for all layers. \param result sums, packed
template <typename Layer>
void sumLayers(const VoxelSet& voxels, const Layer& layer, PackedValues& result, Execution& execution)
{
  result.resize(voxels.count());
  execution.forRange(voxels.size().z, grainPlanes, [&](int begin, int end) {
    if (voxels.planeFirst(begin) == voxels.planeFirst(end))
      return;
    WindowRing ring;
    ring.reset(voxels, 2);
    ring.enter(begin - 1);
    for (int z = begin - 1; z < end; ++z) {
      float* above = ring.enter(z + 1);
      layer(z, ring[z], above);
      if (z >= begin)
        kernels::store(voxels.plane(z), ring[z], result.data() + voxels.planeFirst(z));
    }
  });
}

} // namespace

void WindowRing::reset(const VoxelSet& voxels, int planes)
{
  voxels_ = &voxels;
  planes_ = planes;
  const std::size_t needed = voxels.windowCount() * planes;
  if (values_.size() < needed) {
    values_ = {}; // the old ones are freed first
    values_ = ZeroedFloats(needed);
  }
  held_.assign(planes, noPlane);
}

float* WindowRing::enter(int z)
{
  const std::size_t s = slot(z);
  if (held_[s] != noPlane)
    kernels::fill(voxels_->plane(held_[s]), 0, (*this)[held_[s]]);
  held_[s] = z;
  return (*this)[z];
}

float* WindowRing::enterToOverwrite(int z)
{
  int& held = held_[slot(z)];
  if (held != noPlane && voxels_->areAlike(held, z)) {
    held = z;
    return (*this)[z];
  }
  return enter(z);
}

void WindowRing::clear()
{
  for (int& z : held_)
    if (z != noPlane) {
      kernels::fill(voxels_->plane(z), 0, (*this)[z]);
      z = noPlane;
    }
}

void sumRightHandSide(const SolverGrid& grid, const NormalDraws* draws, PackedValues& b, Execution& execution)
{
  sumLayers(
      grid.voxels, [&](int z, float* y, float* yAbove) { grid.data->addRightHandSide(z, draws, y, yAbove); }, b,
      execution);
}

GridOperator::GridOperator(const SolverGrid& grid, const PriorConstants& prior, double tautness, Execution& execution)
    : grid_(grid), prior_(prior),
      tension_(prior.order == 1 || grid.isWhole ? 0.f : static_cast<float>(std::pow(tautness, 2 * (prior.order - 1))))
{
  const auto largest = static_cast<float>(1.01 * (std::pow(12.0, prior.order) + 12 * tension_));
  sumLayers(
      voxels(), [this](int z, float* y, float* yAbove) { grid_.data->addRowSums(z, y, yAbove); }, inverseD_, execution);
  forEach(execution, inverseD_.size(), grainValues,
          [&](std::size_t i) { inverseD_[i] = 1 / (largest + inverseD_[i]); });
  unobserved_ = 1 / largest * .9999f;
  // The membrane's correction in a band needs no degrees: it is held at zero around the band.
  if (prior.order > 1 || grid.isWhole)
    degrees_ = grid.isWhole ? degreesOfWhole(grid.voxels, execution) : degrees(grid.voxels, execution);
}

void GridOperator::connect(const VoxelSet& coarse, Execution& execution)
{
  if (!grid_.isWhole)
    return;
  const PackedValues ones(coarse.count(), 1.f);
  shares_.resize(voxels().count());
  execution.forRange(voxels().size().z, grainPlanes, [&](int begin, int end) {
    TransferScratch scratch;
    std::vector<float> window(voxels().windowCount(), 0);
    for (int z = begin; z < end; ++z) {
      addProlonged({coarse, ones.data()}, grid_.refinement, voxels(), z, window.data(), scratch);
      float* const shares = shares_.data() + voxels().planeFirst(z);
      kernels::store(voxels().plane(z), window.data(), shares);
      kernels::fill(voxels().plane(z), 0, window.data());
      std::transform(shares, shares + voxels().planeCount(z), shares, [](float sum) { return sum > 0 ? 1 / sum : 0; });
    }
  });
}

void GridOperator::smooth(Sweep sweep, int degree, std::vector<SweepScratch>& scratch, Execution& execution)
{
  float *const out = sweep.out, *const product = sweep.product;
  const int steps =
      stepsPerSweep(voxels().size(), static_cast<double>(voxels().count()), prior_.order, slabsFor(scratch.size()));
  const int sweeps = (degree + steps - 1) / steps, each = (degree + sweeps - 1) / sweeps;
  if (sweeps > 1) {
    iterate_.resize(inverseD_.size());
    for (auto& direction : directions_)
      direction.resize(inverseD_.size());
  }
  for (int n = 0; n < sweeps; ++n) {
    const bool isLast = n + 1 == sweeps;
    if (n > 0) {
      sweep.source = Sweep::Source::packed;
      sweep.x = sweep.out;
      sweep.directionIn = sweep.directionOut;
    }
    sweep.first = n * each + 1;
    sweep.last = std::min(degree, sweep.first + each - 1);
    // Slabs read planes of their neighbors, so a sweep never writes the array it reads.
    sweep.out = (sweeps - 1 - n) % 2 == 0 ? out : iterate_.data();
    sweep.directionOut = isLast ? nullptr : directions_[n % 2].data();
    sweep.product = isLast ? product : nullptr;
    run(sweep, voxels(), scratch, execution);
  }
}

void GridOperator::multiply(const VoxelSet& support, const float* x, const float* b, float* out,
                            std::vector<SweepScratch>& scratch, Execution& execution)
{
  Sweep sweep;
  sweep.x = x;
  sweep.b = b;
  sweep.product = out;
  run(sweep, support, scratch, execution);
}

void GridOperator::restrictTo(const float* fine, const VoxelSet& coarse, float* out, std::vector<SweepScratch>& scratch,
                              Execution& execution) const
{
  const double damping = grid_.data->isDiagonal() ? prior_.voxelDamping : prior_.pointDamping;
  const auto scale = static_cast<float>(damping * std::pow(4., prior_.order) / grid_.refinement.children);
  const auto slabs = static_cast<std::int64_t>(scratch.size());
  execution.forRange(slabs, 1, [&](std::int64_t slab, std::int64_t) {
    for (auto z = static_cast<int>(coarse.size().z * slab / slabs); z < coarse.size().z * (slab + 1) / slabs; ++z)
      restrictPlane({voxels(), fine}, grid_.refinement, scale, coarse, z, out + coarse.planeFirst(z),
                    scratch[slab].transfer);
  });
}

double GridOperator::sweepBytes(const GridSize& size, double unknowns, int order, int degree, int threads)
{
  const int steps = stepsPerSweep(size, unknowns, order, threads), sweeps = (degree + steps - 1) / steps;
  const Wavefront wavefront(order, (degree + sweeps - 1) / sweeps, sweeps > 1, 0, size.z, 0, size.z);
  const double planes = wavefront.products() * (wavefront.powerPlanes() * (order - 1) + wavefront.productPlanes()) +
                        wavefront.iteratePlanes();
  const double window = static_cast<double>(windowStrideOf(size)) * (size.y + 2);
  return sizeof(float) * (planes * threads * window + (sweeps > 1 ? 3 * unknowns : 0));
}

/// One slab per thread, but none thinner than the planes around it that a step and the product after it read.
int GridOperator::slabsFor(std::size_t threads) const
{
  if (voxels().count() < serialVoxels)
    return 1;
  return std::max(1, std::min(static_cast<int>(threads), voxels().size().z / (2 * prior_.order)));
}

/// A sweep over the planes of one slab, called by Wavefront::run.
class GridOperator::SlabPass {
public:
  SlabPass(const GridOperator& system, const Sweep& sweep, const VoxelSet& support, int begin, int end,
           SweepScratch& scratch)
      : system_(system), sweep_(sweep), support_(support), unknowns_(system.voxels()), scratch_(scratch), begin_(begin),
        end_(end), order_(system.prior_.order),
        steps_(sweep.last - sweep.first + 1 - (sweep.source == Sweep::Source::zero ? 1 : 0)),
        wavefront_(order_, steps_, sweep.product != nullptr, begin, end, support.bottom(), support.top())
  {
    const std::size_t products = wavefront_.products();
    scratch.iterate.reset(support, wavefront_.iteratePlanes());
    scratch.powers.resize(std::max(scratch.powers.size(), products));
    scratch.products.resize(std::max(scratch.products.size(), products));
    for (std::size_t n = 0; n < products; ++n) {
      scratch.powers[n].resize(order_ - 1);
      for (WindowRing& power : scratch.powers[n])
        power.reset(support, wavefront_.powerPlanes());
      scratch.products[n].reset(unknowns_, wavefront_.productPlanes());
      scratch.products[n].enter(wavefront_.low(static_cast<int>(n) + 1) - 1);
    }
    const std::size_t needed = unknowns_.largestPlane() * wavefront_.iteratePlanes();
    if (sweep.first <= sweep.last && scratch.directions.size() < needed) {
      scratch.directions = PackedValues();
      scratch.directions.resize(needed); // most of it is never touched
    }
  }

  void run()
  {
    wavefront_.run(*this);
    scratch_.iterate.clear();
    for (int n = 0; n < wavefront_.products(); ++n) {
      scratch_.products[n].clear();
      for (WindowRing& power : scratch_.powers[n])
        power.clear();
    }
  }

  void start(int z)
  {
    const bool addsUp = sweep_.source == Sweep::Source::corrected;
    float* window = addsUp ? scratch_.iterate.enter(z) : scratch_.iterate.enterToOverwrite(z);
    const std::int64_t first = support_.planeFirst(z);
    const Runs runs = support_.plane(z);
    if (sweep_.source == Sweep::Source::zero) {
      kernels::startChebyshev(runs, gain(1), sweep_.b + first, system_.inverseD_.data() + first, direction(z), window);
    } else if (sweep_.source == Sweep::Source::corrected) {
      addProlonged({*sweep_.coarseVoxels, sweep_.coarse}, system_.grid_.refinement, support_, z, window,
                   scratch_.transfer);
      if (system_.shares_.empty())
        kernels::addToWindow(runs, 1, sweep_.x + first, window);
      else
        kernels::scaleAndAdd(runs, system_.shares_.data() + first, sweep_.x + first, window);
    } else {
      kernels::load(runs, sweep_.x + first, window);
    }
    if (sweep_.directionIn)
      std::copy_n(sweep_.directionIn + first, support_.planeCount(z), direction(z));
    else if (steps_ > 0 && sweep_.source != Sweep::Source::zero)
      std::fill_n(direction(z), support_.planeCount(z), 0.f);
    if (steps_ == 0)
      keep(z);
  }

  void differentiate(int step, int power, int z)
  {
    const kernels::Planes source = planesOf(powerOf(step, power - 1), z);
    kernels::laplacian(support_.plane(z), degreesOf(z), source, powerOf(step, power).enterToOverwrite(z));
  }

  void addData(int step, int z)
  {
    float* above = productOf(step).enter(z + 1);
    WindowRing& x = scratch_.iterate;
    system_.grid_.data->addProduct(z, x[z], x[z + 1], productOf(step)[z], above);
  }

  void addPrior(int step, int z)
  {
    if (isAddedByStep(step))
      return;
    float* const product = productOf(step)[z];
    kernels::addLaplacian(unknowns_.plane(z), degreesOf(z), planesOf(powerOf(step, order_ - 1), z), product);
    if (const float* tense = tenseOf(step, z))
      kernels::addWindow(unknowns_.plane(z), system_.tension_, tense, product);
  }

  void update(int step, int z)
  {
    const int i = sweep_.last - steps_ + step;
    const float f = static_cast<float>(2 * i - 3) / static_cast<float>(2 * i + 1);
    const std::int64_t first = unknowns_.planeFirst(z);
    const Runs runs = unknowns_.plane(z);
    const float* const product = productOf(step)[z];
    const kernels::ChebyshevStep next{
        f, gain(i), sweep_.b + first, system_.inverseD_.data() + first, direction(z), scratch_.iterate[z]};
    if (isAddedByStep(step))
      kernels::stepChebyshevWithLaplacian(runs, next, product, degreesOf(z), planesOf(powerOf(step, order_ - 1), z),
                                          system_.tension_, tenseOf(step, z));
    else
      kernels::stepChebyshev(runs, next, product);
    if (step == steps_)
      keep(z);
  }

  void finish(int z)
  {
    const std::int64_t first = unknowns_.planeFirst(z), count = unknowns_.planeCount(z);
    float* const out = sweep_.product + first;
    WindowRing& product = productOf(wavefront_.products());
    if (sweep_.b)
      kernels::residual(unknowns_.plane(z), product[z], sweep_.b + first, out);
    else
      kernels::store(unknowns_.plane(z), product[z], out);
    if (sweep_.isForCoarser && !system_.shares_.empty())
      std::transform(out, out + count, system_.shares_.data() + first, out, std::multiplies<float>());
  }

private:
  static float gain(int i) { return static_cast<float>(8 * i - 4) / static_cast<float>(2 * i + 1); }

  /// True if a step's update adds the last Laplacian to its product, which saves a pass. The membrane's updates are a
  /// plane behind their products: some of the planes that the Laplacian reads are steps ahead by then.
  bool isAddedByStep(int step) const { return order_ > 1 && step <= steps_; }

  /// L x of a correction in a band, which is added with the weight `tension_`; else null.
  const float* tenseOf(int step, int z)
  {
    return system_.tension_ > 0 && &support_ == &unknowns_ ? powerOf(step, 1)[z] : nullptr;
  }

  kernels::Planes planesOf(WindowRing& ring, int z) const
  {
    return {support_.windowStride(), ring[z - 1], ring[z], ring[z + 1]};
  }

  /// Numbers of neighbors of the voxels in their graph; null where the iterate is known all around.
  const float* degreesOf(int z) const
  {
    if (&support_ != &unknowns_ || system_.degrees_.empty())
      return nullptr;
    if (!system_.grid_.isWhole)
      return system_.degrees_.data() + unknowns_.planeFirst(z);
    const int planesBeside = (z > unknowns_.bottom() ? 1 : 0) + (z + 1 < unknowns_.top() ? 2 : 0);
    return system_.degrees_.data() + unknowns_.largestPlane() * planesBeside;
  }

  float* direction(int z)
  {
    const int planes = wavefront_.iteratePlanes();
    return scratch_.directions.data() + unknowns_.largestPlane() * ((z + 1000 * planes) % planes);
  }

  WindowRing& powerOf(int step, int power)
  {
    return power == 0 ? scratch_.iterate : scratch_.powers[step - 1][power - 1];
  }

  WindowRing& productOf(int step) { return scratch_.products[step - 1]; }

  /// Stores the iterate and the direction of a plane of the slab if the sweep asks for them.
  void keep(int z)
  {
    if (z < begin_ || z >= end_)
      return;
    if (sweep_.out)
      kernels::store(unknowns_.plane(z), scratch_.iterate[z], sweep_.out + unknowns_.planeFirst(z));
    if (sweep_.directionOut)
      std::copy_n(direction(z), unknowns_.planeCount(z), sweep_.directionOut + unknowns_.planeFirst(z));
  }

  const GridOperator& system_;
  const Sweep& sweep_;
  const VoxelSet &support_, &unknowns_;
  SweepScratch& scratch_;
  int begin_, end_, order_, steps_;
  Wavefront wavefront_;
};

void GridOperator::run(const Sweep& sweep, const VoxelSet& support, std::vector<SweepScratch>& scratch,
                       Execution& execution) const
{
  // Slabs with about the same number of voxels each.
  const std::int64_t slabs = slabsFor(scratch.size());
  std::vector<int> bounds{0};
  for (std::int64_t slab = 1; slab < slabs; ++slab) {
    int z = bounds.back();
    while (z < voxels().size().z && voxels().planeFirst(z) < voxels().count() * slab / slabs)
      ++z;
    bounds.push_back(z);
  }
  bounds.push_back(voxels().size().z);
  execution.forRange(slabs, 1, [&](std::int64_t slab, std::int64_t) {
    SlabPass(*this, sweep, support, bounds[slab], bounds[slab + 1], scratch[slab]).run();
  });
  execution.poll(); // a V-cycle of millions of voxels takes seconds
}

} // namespace pcl::mrf
