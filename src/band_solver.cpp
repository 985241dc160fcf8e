#include "band_solver.h"

#include "linear_system.h"
#include "plane_kernels.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace pcl {
namespace mrf {
namespace {

/// What the windows of one sweep may take of the last-level cache, counting the voxels in runs of a mean plane: that a
/// few planes along flat parts of the surface do not fit costs less than another sweep over all.
constexpr double windowBytes = 12 << 20;

/// Planes per piece of the passes without stencils.
constexpr int grainPlanes = 4;

int defaultDegree(int order)
{
  return order == 1 ? 2 : order == 2 ? 4 : 5;
}

/// Steps of the smoother in a V-cycle.
struct SmootherDegrees {
  int before, after; ///< the coarser grid's correction
  int coarsest;

  /// Several steps of conjugate gradients want the same before and after, and the coarsest grid solved well. After a
  /// single one everything is left as the smoother leaves it: fewer steps before, and on the one coarse grid, leave
  /// points and holes of a million points 1 % closer to the truth than as many as after, with ten products instead of
  /// twelve.
  static SmootherDegrees of(int degree, int cycles)
  {
    const int half = (degree + 1) / 2;
    return cycles == 1 ? SmootherDegrees{half, degree, half} : SmootherDegrees{degree, degree, 2 * degree};
  }
};

/// Where nothing is observed, a correction of longer waves than 2π over this many voxels spreads like a membrane. A
/// band that is held at one end only would swing under L^k, which continues slopes and curvatures. For k = 2 the value
/// that comes closest to the dense solution on three scans; for k = 3 .25 fills holes better than .35 or .5 do.
constexpr double finestTautness(int order)
{
  return order == 2 ? .35 : .25;
}

/// Steps of the smoother that one sweep takes.
/// \param unknowns of the band
int stepsPerSweep(const GridSize& size, double unknowns, int order, int slabs)
{
  const double planeBytes = std::floor(unknowns / size.z) * sizeof(float);
  const double stepBytes = planeBytes * (2 * (order + 1) + 3 * (order - 1) + 2);
  const int inCache = static_cast<int>(std::min(windowBytes / std::max(stepBytes, 1.), 100.));
  // Each step needs k planes more around a slab: with thin slabs most of the work would be done twice.
  const int inSlab = slabs > 1 ? size.z / slabs / (2 * order) : inCache;
  return std::max(1, std::min(inCache, inSlab));
}

/// Windows of consecutive planes; what is not in a run of the plane that a slot holds is zero.
class WindowRing {
public:
  void reset(const Band& band, int planes)
  {
    band_ = &band;
    planes_ = planes;
    const std::size_t needed = band.windowCount() * static_cast<std::size_t>(planes);
    if (values_.size() < needed) {
      values_ = std::vector<float>(); // growing keeps up to twice as much, and both while it copies
      values_.resize(needed, 0);
    }
    held_.assign(static_cast<std::size_t>(planes), none);
  }

  float* operator[](int z) { return values_.data() + slot(z) * band_->windowCount(); }

  /// The window for a plane that is new to the ring, zero.
  float* enter(int z)
  {
    const std::size_t s = slot(z);
    if (held_[s] != none)
      kernels::clear(band_->plane(held_[s]), (*this)[held_[s]]);
    held_[s] = z;
    return (*this)[z];
  }

  void clear()
  {
    for (int& z : held_)
      if (z != none) {
        kernels::clear(band_->plane(z), (*this)[z]);
        z = none;
      }
  }

private:
  static constexpr int none = -1000000;

  std::size_t slot(int z) const { return static_cast<std::size_t>((z + 1000 * planes_) % planes_); }

  const Band* band_ = nullptr;
  int planes_ = 0;
  std::vector<float> values_;
  std::vector<int> held_;
};

/// What a thread keeps from sweep to sweep.
struct Workspace {
  WindowRing iterate;
  std::vector<std::array<WindowRing, 2>> powers; ///< per product: L x, L² x
  std::vector<WindowRing> products;
  PackedValues directions;
  TransferScratch transfer;
};

/// One sweep: steps [first, last] of the polynomial, all planes in one go, and a product with the system after them.
struct Sweep {
  enum class Source { zero, packed, corrected };
  Source source = Source::packed;
  int first = 1, last = 0;
  const float* b = nullptr;           ///< with steps, or for a residual
  const float* x = nullptr;           ///< iterate at the start
  const float* coarse = nullptr;      ///< its correction, with Source::corrected
  const float* directionIn = nullptr; ///< of step first − 1
  float* out = nullptr;
  float* directionOut = nullptr;
  float* product = nullptr; ///< b − A x, or A x without b
};

class GridSolver {
public:
  /// \param tautness wave number, per voxel, below which the correction is a membrane
  GridSolver(const BandGrid& grid, Prior prior, double tautness, Execution& execution)
      : grid_(grid), order_(order(prior)),
        tension_(order_ == 1 ? 0.f : static_cast<float>(std::pow(tautness, 2 * (order_ - 1))))
  {
    inverseD_.resize(static_cast<std::size_t>(grid.band.count()));
    const auto largest = static_cast<float>(1.01 * (std::pow(12.0, order_) + 12 * tension_));
    assemble([this](int z, float* y, float* yAbove) { grid_.data->addRowSums(z, y, yAbove); }, inverseD_, execution);
    execution.forRange(static_cast<std::int64_t>(inverseD_.size()), sumGrain,
                       [&](std::int64_t begin, std::int64_t end) {
                         for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
                           inverseD_[i] = 1 / (largest + inverseD_[i]);
                       });
    unobserved_ = 1 / largest * .9999f;
    degrees_ = degrees(grid.band, execution);
  }

  const BandGrid& grid() const { return grid_; }
  const Band& band() const { return grid_.band; }
  bool isObserved(std::int64_t voxel) const { return inverseD_[static_cast<std::size_t>(voxel)] < unobserved_; }

  void rightHandSide(PackedValues& b, Execution& execution) const
  {
    b.resize(static_cast<std::size_t>(band().count()));
    assemble([this](int z, float* y, float* yAbove) { grid_.data->addRightHandSide(z, y, yAbove); }, b, execution);
  }

  /// `degree` steps from zero, from x, or from x + P coarse. \param residual b − A out, if wanted
  void smooth(Sweep::Source source, int degree, const float* b, const float* x, const float* coarse,
              const Band* coarseBand, float* out, float* residual, std::vector<Workspace>& workspaces,
              Execution& execution)
  {
    const int steps = stepsPerSweep(slabsFor(workspaces));
    const int sweeps = (degree + steps - 1) / steps;
    const int each = (degree + sweeps - 1) / sweeps;
    if (sweeps > 1) {
      iterate_.resize(inverseD_.size());
      for (auto& direction : directions_)
        direction.resize(inverseD_.size());
    }
    Sweep sweep;
    sweep.source = source;
    sweep.b = b;
    sweep.x = x;
    sweep.coarse = coarse;
    for (int n = 0; n < sweeps; ++n) {
      const bool isLast = n + 1 == sweeps;
      if (n > 0) {
        sweep.source = Sweep::Source::packed;
        sweep.x = sweep.out;
        sweep.directionIn = sweep.directionOut;
      }
      sweep.first = n * each + 1;
      sweep.last = std::min(degree, sweep.first + each - 1);
      // Slabs read planes of their neighbours, so a sweep never writes the array it reads.
      sweep.out = (sweeps - 1 - n) % 2 == 0 ? out : iterate_.data();
      sweep.directionOut = isLast ? nullptr : directions_[n % 2].data();
      sweep.product = isLast ? residual : nullptr;
      run(sweep, band(), coarseBand, workspaces, execution);
    }
  }

  /// out = b − A x, or A x without b. \param support of x: the band, or a superset of it
  void multiply(const Band& support, const float* x, const float* b, float* out, std::vector<Workspace>& workspaces,
                Execution& execution)
  {
    Sweep sweep;
    sweep.x = x;
    sweep.b = b;
    sweep.product = out;
    run(sweep, support, nullptr, workspaces, execution);
  }

  /// coarse = scale Pᵀ fine
  void restrictTo(const float* fine, const Band& coarse, float* out, std::vector<Workspace>& workspaces,
                  Execution& execution)
  {
    const float scale =
        coarseDamping<float>(order_, grid_.data->isDiagonal()) * static_cast<float>(1 << (2 * order_)) / 8;
    const int slabs = static_cast<int>(workspaces.size());
    execution.forRange(slabs, 1, [&](std::int64_t slab, std::int64_t) {
      const auto from = static_cast<int>(coarse.size().z * slab / slabs);
      const auto to = static_cast<int>(coarse.size().z * (slab + 1) / slabs);
      for (int z = from; z < to; ++z)
        restrictPlane(band(), fine, grid_.refinement, scale, coarse, z, out + coarse.planeFirst(z),
                      workspaces[static_cast<std::size_t>(slab)].transfer);
    });
  }

private:
  /// One per thread, but none thinner than the planes around it that a step with a product behind it needs.
  int slabsFor(const std::vector<Workspace>& workspaces) const
  {
    if (band().count() < serialVoxels)
      return 1;
    return std::max(1, std::min(static_cast<int>(workspaces.size()), band().size().z / (2 * order_)));
  }

  int stepsPerSweep(int slabs) const
  {
    return pcl::mrf::stepsPerSweep(band().size(), static_cast<double>(band().count()), order_, slabs);
  }

  /// Packed values of what the layers add up to.
  template <typename Layer>
  void assemble(const Layer& layer, PackedValues& result, Execution& execution) const
  {
    execution.forRange(band().size().z, 4 * grainPlanes, [&](std::int64_t begin, std::int64_t end) {
      WindowRing ring;
      ring.reset(band(), 2);
      ring.enter(static_cast<int>(begin) - 1);
      for (int z = static_cast<int>(begin) - 1; z < static_cast<int>(end); ++z) {
        float* above = ring.enter(z + 1);
        layer(z, ring[z], above);
        if (z >= begin)
          kernels::store(band().plane(z), ring[z], result.data() + band().planeFirst(z));
      }
    });
  }

  void run(const Sweep& sweep, const Band& support, const Band* coarseBand, std::vector<Workspace>& workspaces,
           Execution& execution)
  {
    // Slabs of about as many voxels each.
    const std::int64_t slabs = slabsFor(workspaces);
    std::vector<int> bounds{0};
    for (std::int64_t slab = 1; slab < slabs; ++slab) {
      int z = bounds.back();
      while (z < band().size().z && band().planeFirst(z) < band().count() * slab / slabs)
        ++z;
      bounds.push_back(z);
    }
    bounds.push_back(band().size().z);
    execution.forRange(slabs, 1, [&](std::int64_t slab, std::int64_t) {
      const auto s = static_cast<std::size_t>(slab);
      runSlab(sweep, support, coarseBand, bounds[s], bounds[s + 1], workspaces[s]);
    });
    execution.poll(); // a V-cycle of a large band takes seconds
  }

  void runSlab(const Sweep& sweep, const Band& support, const Band* coarseBand, int zBegin, int zEnd,
               Workspace& workspace) const;

  const BandGrid& grid_;
  int order_;
  float tension_; ///< weight of L_B beside L_B^k
  float unobserved_ = 0;
  PackedValues inverseD_;
  PackedValues degrees_;
  PackedValues iterate_;                   ///< between sweeps, where one does not do
  std::array<PackedValues, 2> directions_; ///< likewise
};

/// Products trail each other by k planes (for k = 1 by two, as an update would overtake the next plane's product).
/// Their powers of L are computed as far ahead as the planes of the product before allow:
///
///     x of step s − 1   . . . . . z+1 z+2 z+3
///     L x               . . . . . z+1 z+2
///     L² x              . . . . . z+1
///     product, x of s   . . . . z
void GridSolver::runSlab(const Sweep& sweep, const Band& support, const Band* coarseBand, int zBegin, int zEnd,
                         Workspace& workspace) const
{
  const int k = order_;
  const int delay = k == 1 ? 1 : 0, lag = k + delay;
  const bool fromZero = sweep.source == Sweep::Source::zero;
  const int steps = sweep.last - sweep.first + 1 - (fromZero ? 1 : 0);
  const int products = steps + (sweep.product ? 1 : 0);
  const auto low = [&](int step) { return zBegin - k * (products - step); };
  const auto high = [&](int step) { return zEnd + k * (products - step); };
  const Band& unknowns = band();
  const int stride = support.windowStride();

  const auto degreesOf = [&](int z) {
    return k > 1 && &support == &unknowns ? degrees_.data() + unknowns.planeFirst(z) : nullptr;
  };

  WindowRing& x = workspace.iterate;
  const int ring = products * lag + k + 3;
  x.reset(support, ring);
  workspace.powers.resize(std::max(workspace.powers.size(), static_cast<std::size_t>(products)));
  workspace.products.resize(std::max(workspace.products.size(), static_cast<std::size_t>(products)));
  for (std::size_t n = 0; n < static_cast<std::size_t>(products); ++n) {
    for (int power = 1; power < k; ++power)
      workspace.powers[n][static_cast<std::size_t>(power - 1)].reset(support, 3);
    workspace.products[n].reset(unknowns, 2 + delay);
    workspace.products[n].enter(low(static_cast<int>(n) + 1) - 1);
  }
  const std::size_t largest = static_cast<std::size_t>(unknowns.largestPlane());
  if (steps > 0 || fromZero)
    if (workspace.directions.size() < largest * static_cast<std::size_t>(ring)) {
      workspace.directions = PackedValues();
      workspace.directions.resize(largest * static_cast<std::size_t>(ring)); // most of it is never touched
    }
  const auto direction = [&](int z) {
    return workspace.directions.data() + largest * static_cast<std::size_t>((z + 1000 * ring) % ring);
  };

  const auto gain = [](int i) { return static_cast<float>(8 * i - 4) / static_cast<float>(2 * i + 1); };
  const auto finish = [&](int z) {
    if (z < zBegin || z >= zEnd)
      return;
    if (sweep.out)
      kernels::store(unknowns.plane(z), x[z], sweep.out + unknowns.planeFirst(z));
    if (sweep.directionOut)
      std::copy_n(direction(z), unknowns.planeCount(z), sweep.directionOut + unknowns.planeFirst(z));
  };
  const auto start = [&](int z) {
    float* window = x.enter(z);
    const std::int64_t first = support.planeFirst(z);
    const Runs runs = support.plane(z);
    if (fromZero) {
      kernels::startBand(runs, gain(1), sweep.b + first, inverseD_.data() + first, direction(z), window);
    } else {
      kernels::load(runs, sweep.x + first, window);
      if (sweep.source == Sweep::Source::corrected)
        addProlonged(*coarseBand, sweep.coarse, grid_.refinement, support, z, window, workspace.transfer);
      if (sweep.directionIn)
        std::copy_n(sweep.directionIn + first, support.planeCount(z), direction(z));
      else if (steps > 0)
        std::fill_n(direction(z), support.planeCount(z), 0.f);
    }
    if (steps == 0)
      finish(z);
  };
  const auto update = [&](int step, int z) {
    const int i = sweep.last - steps + step;
    const std::int64_t first = unknowns.planeFirst(z);
    WindowRing& product = workspace.products[static_cast<std::size_t>(step - 1)];
    kernels::smoothBand(unknowns.plane(z), static_cast<float>(2 * i - 3) / static_cast<float>(2 * i + 1), gain(i),
                        product[z], sweep.b + first, inverseD_.data() + first, direction(z), x[z]);
    if (step == steps)
      finish(z);
  };
  const auto advance = [&](int step, int z) {
    const auto n = static_cast<std::size_t>(step - 1);
    std::array<WindowRing, 2>& powers = workspace.powers[n];
    WindowRing& product = workspace.products[n];
    // The highest power first known: each plane of a power needs one more of the one below.
    for (int power = 1; power < k; ++power) {
      const int at = z + k - power;
      if (at < low(step) - (k - power) || at >= high(step) + (k - power))
        continue;
      WindowRing& target = powers[static_cast<std::size_t>(power - 1)];
      WindowRing& source = power == 1 ? x : powers[static_cast<std::size_t>(power - 2)];
      kernels::bandLaplacian(support.plane(at), degreesOf(at), stride, source[at - 1], source[at], source[at + 1],
                             target.enter(at));
    }
    if (z < low(step) - 1 || z >= high(step))
      return;
    float* above = product.enter(z + 1);
    grid_.data->addProduct(z, x[z], x[z + 1], product[z], above);
    if (z < low(step))
      return;
    WindowRing& source = k == 1 ? x : powers[static_cast<std::size_t>(k - 2)];
    kernels::addBandLaplacian(unknowns.plane(z), degreesOf(z), stride, source[z - 1], source[z], source[z + 1],
                              product[z]);
    if (k > 1 && &support == &unknowns)
      kernels::addWindow(unknowns.plane(z), tension_, powers[0][z], product[z]);
    if (step > steps) {
      const std::int64_t first = unknowns.planeFirst(z);
      if (sweep.b)
        kernels::residual(unknowns.plane(z), product[z], sweep.b + first, sweep.product + first);
      else
        kernels::store(unknowns.plane(z), product[z], sweep.product + first);
    } else if (z - delay >= low(step)) {
      update(step, z - delay);
    }
  };

  const int last = high(0) + products * lag + k;
  for (int t = low(0); t < last; ++t) {
    if (t < high(0))
      start(t);
    for (int step = 1; step <= products; ++step) {
      const int z = t - step * lag;
      advance(step, z);
      if (delay > 0 && step <= steps && z == high(step))
        update(step, z - 1);
    }
  }

  x.clear();
  for (std::size_t n = 0; n < static_cast<std::size_t>(products); ++n) {
    workspace.products[n].clear();
    for (int power = 1; power < k; ++power)
      workspace.powers[n][static_cast<std::size_t>(power - 1)].clear();
  }
}

/// One V-cycle on the bands.
class BandPreconditioner {
public:
  BandPreconditioner(const std::vector<BandGrid>& grids, Prior prior, const SmootherDegrees& degrees, int threads,
                     Execution& execution)
      : degrees_(degrees), workspaces_(static_cast<std::size_t>(threads))
  {
    double tautness = finestTautness(order(prior));
    for (const BandGrid& grid : grids) {
      levels_.emplace_back();
      Level& level = levels_.back();
      level.solver = std::make_unique<GridSolver>(grid, prior, tautness, execution);
      tautness *= 2; // the same wave in larger voxels
      const auto count = static_cast<std::size_t>(grid.band.count());
      if (levels_.size() > 1)
        level.rightHandSide.resize(count);
      level.before.resize(count);
      level.after.resize(count);
    }
  }

  GridSolver& finest() { return *levels_.front().solver; }
  std::vector<Workspace>& workspaces() { return workspaces_; }

  /// z = M r, valid until the next call.
  const PackedValues& apply(const float* r, Execution& execution) { return cycle(0, r, execution); }

  /// A vector of the finest grid that is free between calls of apply.
  PackedValues& spare() { return levels_.front().before; }

private:
  struct Level {
    std::unique_ptr<GridSolver> solver;
    PackedValues rightHandSide, before, after;
  };

  const PackedValues& cycle(std::size_t index, const float* b, Execution& execution)
  {
    Level& level = levels_[index];
    GridSolver& solver = *level.solver;
    if (index + 1 == levels_.size()) {
      solver.smooth(Sweep::Source::zero, degrees_.coarsest, b, nullptr, nullptr, nullptr, level.after.data(), nullptr,
                    workspaces_, execution);
      return level.after;
    }
    Level& coarse = levels_[index + 1];
    const Band& coarseBand = coarse.solver->band();
    solver.smooth(Sweep::Source::zero, degrees_.before, b, nullptr, nullptr, nullptr, level.before.data(),
                  level.after.data(), workspaces_, execution);
    solver.restrictTo(level.after.data(), coarseBand, coarse.rightHandSide.data(), workspaces_, execution);
    const PackedValues& correction = cycle(index + 1, coarse.rightHandSide.data(), execution);
    solver.smooth(Sweep::Source::corrected, degrees_.after, b, level.before.data(), correction.data(), &coarseBand,
                  level.after.data(), nullptr, workspaces_, execution);
    return level.after;
  }

  SmootherDegrees degrees_;
  std::vector<Workspace> workspaces_;
  std::vector<Level> levels_;
};

/// Clears the residual where nothing is observed and L^k reaches over the rim of the band: the guess may have kinks out
/// there, which are none of the correction's business.
void clearNearRim(const GridSolver& system, int order, PackedValues& r, Execution& execution)
{
  const Band& band = system.band();
  const Band inside = eroded(band, order, execution);
  execution.forRange(band.size().z, grainPlanes, [&](std::int64_t begin, std::int64_t end) {
    for (int z = static_cast<int>(begin); z < static_cast<int>(end); ++z)
      for (int y = 0; y < band.size().y; ++y) {
        const Runs inner = inside.row(y, z);
        const Run* next = inner.begins;
        for (const Run& run : band.row(y, z))
          for (std::int32_t at = run.at; at < run.at + run.count; ++at) {
            while (next != inner.ends && next->at + next->count <= at)
              ++next;
            const std::int64_t voxel = band.planeFirst(z) + run.first + (at - run.at);
            if ((next == inner.ends || next->at > at) && !system.isObserved(voxel))
              r[static_cast<std::size_t>(voxel)] = 0;
          }
      }
  });
}

/// Sums of one step, over planes.
struct StepSums {
  double residual = 0, change = 0, voxels = 0;
};

} // namespace

double bandWindowBytes(const GridSize& size, double unknowns, Prior prior, const SolverOptions& options, int threads)
{
  const int k = order(prior), delay = k == 1 ? 1 : 0;
  const int degree = options.smootherDegree > 0 ? options.smootherDegree : defaultDegree(k);
  const int steps = stepsPerSweep(size, unknowns, k, threads), sweeps = (degree + steps - 1) / steps;
  const int products = (degree + sweeps - 1) / sweeps + (sweeps > 1 ? 1 : 0);
  // Of each product three planes of each power below and those that it adds up in; the iterate spans all of them.
  const double planes = products * (k + delay) + k + 3 + products * (3 * (k - 1) + 2 + delay);
  const double window = static_cast<double>(size.x + 2 * windowMargin) * (size.y + 2);
  return sizeof(float) * (planes * threads * window + (sweeps > 1 ? 3 * unknowns : 0));
}

SolveReport solveOnBand(const std::vector<BandGrid>& grids, Prior prior, const Band& support, int steps, int threads,
                        const SolverOptions& options, double unit, PackedValues& values, Execution& execution)
{
  SolveReport report;
  report.method = SolverMethod::multigrid;
  const int maxIterations = options.maxIterations > 0 ? options.maxIterations : steps;
  const int degree = options.smootherDegree > 0 ? options.smootherDegree : defaultDegree(order(prior));
  BandPreconditioner preconditioner(grids, prior, SmootherDegrees::of(degree, maxIterations), threads, execution);
  GridSolver& system = preconditioner.finest();
  const Band& band = system.band();

  PackedValues r, p;
  system.rightHandSide(r, execution);
  const double norm = std::sqrt(dotProduct(r, r, execution));
  system.multiply(support, values.data(), r.data(), r.data(), preconditioner.workspaces(), execution);
  clearNearRim(system, order(prior), r, execution);
  const double scale = norm > 0 ? norm : std::sqrt(dotProduct(r, r, execution));
  if (!(scale > 0)) {
    report.converged = true;
    return report;
  }
  PackedValues& product = preconditioner.spare();
  report.relativeResidual = std::sqrt(dotProduct(r, r, execution)) / scale;
  const double initial = std::max(report.relativeResidual, options.residualTolerance);
  std::vector<StepSums> parts(static_cast<std::size_t>(band.size().z));
  const PackedValues* direction = nullptr; // p, from the second step on
  double gamma = 0;
  bool settled = false;
  while (!settled && report.relativeResidual > options.residualTolerance && report.iterations < maxIterations) {
    if (report.iterations == 1)
      p = *direction; // the preconditioner is about to use its memory again
    const PackedValues& z = preconditioner.apply(r.data(), execution);
    const double next = dotProduct(r, z, execution);
    const float beta = report.iterations == 0 ? 0.f : static_cast<float>(next / gamma);
    gamma = next;
    if (report.iterations > 0)
      execution.forRange(static_cast<std::int64_t>(p.size()), sumGrain, [&](std::int64_t begin, std::int64_t end) {
        kernels::scaleAndAdd(end - begin, beta, z.data() + begin, p.data() + begin);
      });
    direction = report.iterations == 0 ? &z : &p;
    system.multiply(band, direction->data(), nullptr, product.data(), preconditioner.workspaces(), execution);
    const double curvature = dotProduct(*direction, product, execution);
    if (!(std::isfinite(gamma) && std::isfinite(curvature)))
      throw SolverFailure("multigrid: the iteration broke down with values that are not finite");
    if (!(curvature > 0 && gamma > 0))
      break; // nothing but rounding is left
    const auto step = static_cast<float>(gamma / curvature);

    const auto near = static_cast<float>(2 * unit);
    execution.forRange(band.size().z, grainPlanes, [&](std::int64_t begin, std::int64_t end) {
      for (int plane = static_cast<int>(begin); plane < static_cast<int>(end); ++plane) {
        StepSums sums;
        forEachPair(band, support, plane, [&](std::int64_t inner, std::int64_t outer, std::int64_t count) {
          float* const d = values.data() + outer;
          float* const residual = r.data() + inner;
          for (std::int64_t i = 0; i < count; ++i) {
            const float change = step * (*direction)[static_cast<std::size_t>(inner + i)];
            d[i] += change;
            residual[i] -= step * product[static_cast<std::size_t>(inner + i)];
            sums.residual += static_cast<double>(residual[i]) * static_cast<double>(residual[i]);
            if (std::abs(d[i]) < near && system.isObserved(inner + i)) {
              sums.change += static_cast<double>(change) * static_cast<double>(change);
              ++sums.voxels;
            }
          }
        });
        parts[static_cast<std::size_t>(plane)] = sums;
      }
    });
    StepSums total;
    for (const StepSums& part : parts) {
      total.residual += part.residual;
      total.change += part.change;
      total.voxels += part.voxels;
    }
    ++report.iterations;
    settled = options.changeTolerance > 0 && total.voxels > 0 &&
              std::sqrt(total.change / total.voxels) < options.changeTolerance * unit;
    report.relativeResidual = std::sqrt(total.residual) / scale;
    report.history.push_back(report.relativeResidual);
    execution.progress(std::clamp(std::log(initial / std::max(report.relativeResidual, 1e-300)) /
                                      std::log(initial / options.residualTolerance * 1.0000001),
                                  0.0, 1.0));
  }
  report.converged = settled || report.relativeResidual <= options.residualTolerance ||
                     (options.maxIterations == 0 && report.iterations == steps);
  return report;
}

} // namespace mrf
} // namespace pcl
