// SPDX-License-Identifier: BSD-3-Clause
#include "levels/multiscale.h"

#include "base/loops.h"
#include "base/memory.h"
#include "base/text.h"
#include "field/field_contents.h"
#include "field/interpolation.h"
#include "levels/level_memory.h"
#include "levels/narrow_band.h"
#include "levels/tiled_band.h"
#include "mesh/polygonizer.h"
#include "observation/observation.h"
#include "observation/point_observation.h"
#include "options/stage_timer.h"
#include "options/validation.h"
#include "solver/cholesky.h"
#include "solver/grid_solver.h"
#include "solver/grids.h"
#include "solver/linear_system.h"
#include "tiles/do_task.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>

namespace pcl::mrf {
namespace {

/// Voxels [lower, upper) of a level, in multiples of its voxel side from the corner shared by all levels.
struct IndexBox {
  Eigen::Array3i lower = Eigen::Array3i::Zero(), upper = Eigen::Array3i::Zero();

  Lattice toLattice(const Eigen::Vector3d& corner, double spacing) const
  {
    const Eigen::Array3i size = upper - lower;
    return {{size.x(), size.y(), size.z()}, corner + spacing * (lower.cast<double>() + .5).matrix(), spacing};
  }
};

Eigen::Array3d halved(const Eigen::Array3i& index)
{
  return index.cast<double>() / 2;
}

std::vector<float> denseConfidences(const Observation& observation)
{
  std::vector<float> confidences(observation.lattice.size.count(), 0);
  for (std::size_t v = 0; v < observation.voxels.size(); ++v)
    confidences[observation.voxels[v]] = observation.confidences[v];
  return confidences;
}

/// Local confidences of observed voxels, packed on a band.
std::vector<float> bandConfidences(const Observation& observation, const VoxelSet& band)
{
  const GridSize size = observation.lattice.size;
  std::vector<float> confidences(band.count(), 0);
  for (std::size_t v = 0; v < observation.voxels.size(); ++v) {
    const Eigen::Array3i voxel = size.voxel(observation.voxels[v]) + gridMargin;
    if (const std::int64_t at = band.find(voxel.x(), voxel.y(), voxel.z()); at >= 0)
      confidences[at] = observation.confidences[v];
  }
  return confidences;
}

/// Steps and coarse grids of the first band, of those between, and of the last of several. A single step weighs short
/// and long waves alike: the long ones are right already, and more coarse grids would spoil them.
constexpr LevelPlan firstPlan = {4, 3}, middlePlan = {2, 3}, lastPlan = {1, 1};

/// Factor on changeTolerance of dense levels that observe points. On those that observe voxels it makes holes worse.
constexpr double pointTolerance = 1.5;

/// Factor on the weight of the normals on all levels but the last, if that is a band of order 3. Bands move the surface
/// to the points again, but hardly what fills a hole, which depends on the normals at its rim. Noise of more than a
/// spacing turns the normals too far for that.
constexpr double normalsOfGuess = 10;

/// Max voxel side of the last level, in spacings, with which normalsOfGuess is used: with larger ones coarse levels see
/// the points well, and holes are many voxels wide.
constexpr float normalsLeadUpTo = 2.4f;

/// An observation on the same lattice with its axes in stored order.
Observation toStored(const AxisOrder& axes, const Observation& observation)
{
  Observation stored;
  stored.lattice = axes.toStored(observation.lattice);
  std::vector<std::pair<std::int64_t, std::size_t>> order; // voxels, and where they are in the observation
  for (std::size_t n = 0; n < observation.voxels.size(); ++n) {
    const Eigen::Array3i voxel = axes.toStored(observation.lattice.size.voxel(observation.voxels[n]));
    order.emplace_back(stored.lattice.size.index(voxel.x(), voxel.y(), voxel.z()), n);
  }
  std::sort(order.begin(), order.end());
  for (const auto& [voxel, n] : order) {
    stored.voxels.push_back(voxel);
    stored.distances.push_back(observation.distances[n]);
    stored.confidences.push_back(observation.confidences[n]);
  }
  return stored;
}

/// Dense levels, then those in bands.
class LevelSolver : public Levels {
public:
  LevelSolver(const SolvedPiece& piece, float spacing, const Options& options, Execution& execution, int tiles)
      : spacing_(spacing), options_(options), execution_(execution), piece_(piece), tiles_(tiles)
  {
    validate(options.observation);
    validate(options.prior);
    validate(options.solver);
    validate(options.multiscale);
    plan();
    firstLevel_ = next_ = addCoarserGrids(lattices_);
    denseLevels_ = lattices_.size();
    // The coarsest level is always dense.
    while (denseLevels_ > firstLevel_ + 1 && lattices_[denseLevels_ - 1].size.count() > options_.multiscale.denseVoxels)
      --denseLevels_;
    isTiled_ = isTiled_ || (execution_.tasks() && static_cast<double>(points().size()) > unknownsPerTask);
    isTiled_ = maxTilesOfFinest() > 1 && (tiles_ > 0 ? tiles_ > 1 : isTiled_);
    if (options_.observation.atPoints())
      takeSamples();
    for (std::size_t level = firstLevel_; level < lattices_.size(); ++level)
      voxels_ += static_cast<double>(lattices_[level].size.count());
  }

  bool done() const override { return next_ == lattices_.size(); }

  float voxelSize() const override { return static_cast<float>(lattices_[next_ - 1].spacing); }

  void solveNext() override
  {
    if (next_ >= denseLevels_) {
      leaveSparse();
      // The first band has at least half as many unknowns as what a dense level hands on.
      if (next_ > denseLevels_ || isFinest(next_))
        checkUnknowns(next_ - 1, (next_ > denseLevels_ ? 1 : .5) * static_cast<double>(band_.unknowns.count()));
    }
    const double begin = solvedVoxels_ / voxels_;
    solvedVoxels_ += static_cast<double>(lattices_[next_].size.count());
    execution_.beginStep(begin, solvedVoxels_ / voxels_);
    result_.levels.push_back(next_ < denseLevels_ ? solveDense(next_) : solveInBand(next_));
    ++next_;
    execution_.progress(1);
  }

  bool needsRoom() const override { return isTiled_ && next_ + 2 >= lattices_.size(); }

  bool mayLeaveOut() const override
  {
    if (done() || next_ < denseLevels_)
      return false;
    // The first band decides what fills holes, and the sheets around holes influence it: without them the discs of a
    // Kinect frame came out a tenth worse. A mesh before the finest level is worth its cost only if there was none yet.
    return next_ > denseLevels_ ? next_ == denseLevels_ + 1 || !isFinest(next_) : isFinest(next_);
  }

  TriangleMesh zeroLevel() override
  {
    const auto banded = std::make_shared<BandedDistances>(
        BandedDistances{std::move(band_.support), std::move(band_.values), {}, coarser(distances_)});
    TriangleMesh mesh = polygonize(DistanceField(lattices_[next_ - 1], banded, axes_), execution_);
    band_.support = std::move(banded->band);
    band_.values = std::move(banded->values);
    zeroLevelTriangles_ = mesh.triangles.size();
    return mesh;
  }

  void refineOnly(const TriangleMesh& wanted) override
  {
    if (wanted.triangles.size() == zeroLevelTriangles_)
      return;
    const auto all = [](std::size_t) { return true; };
    keepNear(voxelsOf(wanted.vertices, lattices_[next_ - 1], all), band_, execution_);
    for (const Left& left : left_)
      keepNear(voxelsOf(wanted.vertices, left.lattice, all), *left.distances, execution_);
  }

  MultiscaleResult result() override
  {
    if (result_.levels.back().observed == 0)
      throw InvalidInput(textOf(6, "no voxel of side ", lattices_.back().spacing, " is closer than dEmax = ",
                                maxDistance_, " to a point; choose a smaller voxel size or a larger dEmax"));
    result_.field = field();
    return std::move(result_);
  }

private:
  /// The part of a level that no finer level resolves.
  struct Left {
    Lattice lattice;
    std::shared_ptr<BandedDistances> distances;
  };

  const OrientedPoints& points() const { return *piece_.points; }

  /// Plans lengths, lattices and memory before anything is allocated.
  void plan()
  {
    MultiscaleOptions& multiscale = options_.multiscale;
    const BoundingBox& volume = piece_.volume;
    if (!(multiscale.voxelSize > 0))
      multiscale.voxelSize = spacingsPerVoxel(multiscale.quality) * spacing_;
    maxDistance_ = resolvedMaxDistance(options_.observation, spacing_, multiscale.voxelSize);
    workload_ = workloadOf(points().size(), spacing_, options_.prior);
    workload_.reach = options_.observation.atPoints() ? 0 : maxDistance_;
    workload_.solver = options_.solver;
    multiscale.denseVoxels = maxDenseVoxels(multiscale, workload_);
    lattices_ = planLevels(volume, multiscale.voxelSize, workload_, multiscale);
    workload_.isTiled = predictedBytes(volume, multiscale.voxelSize, workload_, multiscale, 1) > limit();
    bandThreads_ = affordableThreads(volume, multiscale.voxelSize, workload_, multiscale, execution_.threads());
    result_.predictedBytes =
        static_cast<std::size_t>(predictedBytes(volume, multiscale.voxelSize, workload_, multiscale, bandThreads_));
    const GridSize finest = lattices_.back().size;
    if (finest.count() > multiscale.denseVoxels)
      axes_ = bandAxes(finest);
    for (Lattice& lattice : lattices_)
      lattice = axes_.toStored(lattice);
    isTiled_ = workload_.isTiled;
  }

  void takeSamples()
  {
    const PointsOnLattice seen{points(), lattices_.back(), spacing_, axes_};
    samples_ = isTiled_ ? LevelSamples::beneathFinest(seen, lattices_, execution_)
                        : LevelSamples(samplesOfFinest(seen, execution_), lattices_, execution_);
  }

  bool isFinest(std::size_t level) const { return level + 1 == lattices_.size(); }

  /// True if the normals weigh more on the levels before the last one.
  bool normalsLead() const
  {
    return options_.prior.kind == Prior::triharmonic && denseLevels_ < lattices_.size() &&
           lattices_.back().spacing <= normalsLeadUpTo * spacing_ && points().typicalDeviation <= spacing_;
  }

  LevelReport newReport(std::size_t level) const
  {
    LevelReport report;
    report.size = axes_.fromStored(lattices_[level].size);
    report.voxelSize = lattices_[level].spacing;
    report.maxDistance = maxDistance_;
    report.unknowns = report.size.count();
    if (!isFinest(level))
      report.maxDistance = std::max(maxDistance_, static_cast<float>(1.5 * report.voxelSize));
    return report;
  }

  Observation observeVoxels(std::size_t level, const LevelReport& report)
  {
    const Lattice lattice = axes_.fromStored(lattices_[level]);
    Observation result =
        observe(points(), *piece_.search, lattice, spacing_, report.maxDistance, options_.observation, execution_);
    if (!axes_.isNatural())
      result = toStored(axes_, result);
    if (isFinest(level))
      finest_ = result;
    return result;
  }

  LevelObservation observeLevel(std::size_t level, LevelReport& report)
  {
    LevelObservation observation;
    if (options_.observation.atPoints()) {
      observation.samples = &samples_;
      observation.weights =
          levelWeights(options_.prior.kind, options_.observation, spacing_, lattices_[level].spacing, isFinest(level));
      if (!isFinest(level) && normalsLead())
        observation.weights.gradient *= normalsOfGuess;
    } else {
      observation.voxels = observeVoxels(level, report);
      observation.prior = options_.prior;
      report.observed = static_cast<std::int64_t>(observation.voxels.voxels.size());
    }
    return observation;
  }

  LevelReport solveDense(std::size_t level)
  {
    LevelReport report = newReport(level);
    const Lattice& lattice = lattices_[level];
    const Clock::time_point start = Clock::now();
    const LevelObservation observation = observeLevel(level, report);
    if (options_.observation.atPoints())
      report.observed = observedVoxels(samples_.own[level], withMargin(lattice.size), execution_).count();
    else if (level + 1 == denseLevels_)
      lastDense_ = observation.voxels.voxels;
    report.observationSeconds = secondsSince(start);

    const Clock::time_point solverStart = Clock::now();
    if (level == firstLevel_)
      distances_.assign(lattice.size.count(), 0);
    else
      distances_ = (options_.multiscale.interpolation == Interpolation::linear ? interpolateLinear : interpolateCubic)(
          distances_, lattices_[level - 1], lattice, execution_);
    // With a narrow reach the coarse levels of the paper's scheme may see nothing: their guess is then kept.
    if (report.observed > 0)
      report.solve = solveWhole(level, observation);
    if (level + 1 == denseLevels_ && !isFinest(level))
      beginBand();
    report.solverSeconds = secondsSince(solverStart);
    return report;
  }

  /// Makes the field that the last dense level hands to the first band.
  void beginBand()
  {
    const Lattice& coarse = lattices_[denseLevels_ - 1];
    const GridSize size = withMargin(coarse.size);
    band_ =
        fieldOfDense(coarse, distances_,
                     options_.observation.atPoints() ? observedVoxels(samples_.own[denseLevels_ - 1], size, execution_)
                                                     : voxelSetOf(lastDense_, coarse.size, size, execution_),
                     execution_);
  }

  /// The voxels around those positions of the recentered frame whose indices are asked for.
  VoxelSet voxelsOf(const std::vector<Eigen::Vector3f>& positions, const Lattice& lattice,
                    const std::function<bool(std::size_t)>& isAsked) const
  {
    constexpr std::int64_t grain = 1 << 14;
    const Eigen::Array3d last = Eigen::Array3d(lattice.size.x, lattice.size.y, lattice.size.z) - 1;
    const auto sort = [](std::vector<std::int64_t>& voxels) {
      std::sort(voxels.begin(), voxels.end());
      voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
    };
    // Consecutive positions are close to each other: a list per range, without repeated voxels, is much shorter.
    std::vector<std::int64_t> voxels = joined(partsOf<std::vector<std::int64_t>>(
        execution_, positions.size(), grain, [&](std::vector<std::int64_t>& own, std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            if (!isAsked(i))
              continue;
            const Eigen::Array3d at = lattice.toVoxels(axes_.toStored(positions[i])).array();
            const Eigen::Array3i voxel = at.max(0).min(last).cast<int>();
            own.push_back(lattice.size.index(voxel.x(), voxel.y(), voxel.z()));
          }
          sort(own);
        }));
    sort(voxels);
    return voxelSetOf(voxels, lattice.size, withMargin(lattice.size), execution_);
  }

  /// Makes the last level the finest one where points are sparse: where the ratio of its voxel side to the local
  /// spacing is at most half of the ratio of the finest voxel side to the typical spacing.
  void leaveSparse()
  {
    if (!options_.observation.atPoints() || points().spacings.empty() || options_.trimming.watertight)
      return;
    const Lattice& lattice = lattices_[next_ - 1];
    const auto dense = 2 * spacing_ * static_cast<float>(lattice.spacing / lattices_.back().spacing);
    const auto isDense = [&](std::size_t point) { return points().spacings[point] < dense; };
    if (auto left = leaveFarFrom(voxelsOf(points().positions, lattice, isDense), band_, execution_))
      left_.push_back({lattice, std::move(left)});
  }

  /// The field of the levels before the last one. \param dense distances on the last dense level
  DistanceField coarser(std::vector<float> dense) const
  {
    DistanceField field(lattices_[denseLevels_ - 1], std::move(dense), {});
    for (const Left& left : left_) {
      const auto banded = std::make_shared<BandedDistances>(*left.distances);
      banded->background = std::move(field);
      field = DistanceField(left.lattice, banded);
    }
    return field;
  }

  SolveReport solveWhole(std::size_t level, const LevelObservation& observation)
  {
    const Lattice& lattice = lattices_[level];
    SolverOptions solver = options_.solver;
    if (level == firstLevel_ && solver.choleskyOnCoarsest)
      solver.method = SolverMethod::cholesky;
    if (solvesPlainly(solver, options_.prior, options_.observation.atPoints()))
      return solvePlain(lattice, observation, level, solver);
    if (options_.observation.atPoints())
      solver.changeTolerance *= pointTolerance;
    return solveWholeGrids(wholeGrids(lattices_, level, observation, options_.prior.kind, execution_),
                           options_.prior.kind, solver, lattice.spacing, distances_, execution_);
  }

  SolveReport solvePlain(const Lattice& lattice, const LevelObservation& observation, std::size_t level,
                         const SolverOptions& solver)
  {
    const LinearSystem system = options_.observation.atPoints()
                                    ? assembleAtPoints(lattice.size, options_.prior.kind, samples_.own[level],
                                                       observation.weights, lattice.spacing, execution_)
                                    : assemble(observation.voxels, options_.prior, execution_);
    std::vector<double> distances(distances_.begin(), distances_.end());
    const SolveReport report = solve(system, solver, lattice.spacing, distances, execution_);
    std::transform(distances.begin(), distances.end(), distances_.begin(),
                   [](double distance) { return static_cast<float>(distance); });
    return report;
  }

  LevelReport solveInBand(std::size_t level)
  {
    LevelReport report = newReport(level);
    const Clock::time_point start = Clock::now();
    const int tiles = isFinest(level) ? tilesOfFinest() : 1;
    const LevelObservation observation = observeLevel(level, report);
    report.observationSeconds = secondsSince(start);
    const Clock::time_point solverStart = Clock::now();
    LevelPlan plan = level == denseLevels_ ? firstPlan : isFinest(level) ? lastPlan : middlePlan;
    plan.threads = bandThreads_;
    report.tiles = tiles;
    if (tiles > 1) {
      const PointsOnLattice seen{points(), lattices_[level], spacing_, axes_};
      band_ = solveInTiles({seen, observation.weights, options_.prior.kind, tiles}, band_, plan, options_.solver,
                           report, execution_);
    } else {
      band_ = solveNarrowBand({lattices_, level, observation, options_.prior.kind, nullptr, level == denseLevels_},
                              band_, plan, options_.solver, report, execution_);
    }
    report.solverSeconds = secondsSince(solverStart);
    return report;
  }

  double limit() const { return memoryLimit(options_.multiscale.maxMemory); }

  /// The number of unknowns of the finest level, predicted from that of a coarser level.
  double finestUnknowns(std::size_t level, double unknowns) const
  {
    return std::ldexp(unknowns, 2 * static_cast<int>(lattices_.size() - 1 - level));
  }

  double finestBytes(double unknowns, int tiles) const
  {
    return finestBandBytes(lattices_.back().size, unknowns, workload_, tiles, bandThreads_);
  }

  int maxTilesOfFinest() const
  {
    const auto bands = static_cast<int>(lattices_.size() - denseLevels_);
    return mayBeTiled(workload_, bands) ? maxTiles(lattices_.back().size.z) : 1;
  }

  /// \throw ResourceLimit if the unknowns of the finest level, predicted from those of a coarser one, are too many
  void checkUnknowns(std::size_t level, double unknowns) const
  {
    const double finest = finestUnknowns(level, unknowns);
    checkSurface(finest, std::min(finestBytes(finest, 1), finestBytes(finest, maxTilesOfFinest())), points().size(),
                 lattices_.back().spacing, limit());
  }

  /// The number of tiles of the finest level: as few as fit into the memory, or as suit tasks. With more than one the
  /// samples are freed, as each tile makes its own.
  int tilesOfFinest()
  {
    const double unknowns = finestUnknowns(next_ - 1, static_cast<double>(band_.unknowns.count()));
    const int max = maxTilesOfFinest();
    int tiles = isTiled_ ? std::max(tiles_, 2) : 1;
    if (isTiled_ && tiles_ == 0 && execution_.tasks())
      tiles = std::clamp(static_cast<int>(std::ceil(unknowns / unknownsPerTask)), tiles, std::max(tiles, max / 3));
    while (tiles_ == 0 && tiles < max && finestBytes(unknowns, tiles) > limit())
      ++tiles;
    if (tiles > 1)
      samples_ = LevelSamples();
    return tiles;
  }

  DistanceField field()
  {
    const Lattice& lattice = lattices_.back();
    if (denseLevels_ == lattices_.size())
      return DistanceField(lattice, std::move(distances_),
                           options_.observation.atPoints() ? std::vector<float>() : denseConfidences(finest_));
    auto banded = std::make_shared<BandedDistances>(
        BandedDistances{std::move(band_.support), std::move(band_.values), {}, coarser(std::move(distances_))});
    if (!options_.observation.atPoints())
      banded->confidences = bandConfidences(finest_, banded->band);
    return DistanceField(lattice, std::move(banded), axes_);
  }

  float spacing_, maxDistance_ = 0;
  Options options_;   ///< with denseVoxels for the workload
  Workload workload_; ///< of the whole run
  Execution& execution_;
  const SolvedPiece piece_;
  std::vector<Lattice> lattices_; ///< as they are stored, like all that follows
  AxisOrder axes_;                ///< the stored order of the cloud's axes
  int bandThreads_ = 1;
  int tiles_;                            ///< that were asked for; 0: as few as fit
  bool isTiled_ = false;                 ///< if the finest level is tiled: decided before samples are made
  std::size_t firstLevel_ = 0;           ///< index of the first level; lattices before it are grids of the solver
  std::size_t denseLevels_ = 0;          ///< index of the first level in a band
  std::size_t next_ = 0;                 ///< index of the next level to be solved
  double voxels_ = 0, solvedVoxels_ = 0; ///< of all levels, and of those that are solved
  std::size_t zeroLevelTriangles_ = 0;   ///< of the last zeroLevel()
  LevelSamples samples_;                 ///< if points are observed
  Observation finest_;                   ///< on the finest level, if voxels are observed
  std::vector<std::int64_t> lastDense_;  ///< voxels observed on the last dense level
  std::vector<float> distances_;         ///< of the last dense level so far
  std::vector<Left> left_;               ///< of the levels so far
  LevelField band_;                      ///< of the last level in a band so far
  MultiscaleResult result_;
};

} // namespace

int resolvedPadding(const MultiscaleOptions& options)
{
  return options.padding > 0 ? options.padding : minPadding;
}

std::int64_t resolvedDenseVoxels(const MultiscaleOptions& options, std::size_t points)
{
  constexpr std::int64_t perPoint = 350, min = std::int64_t{1} << 18, max = std::int64_t{1} << 20;
  if (options.denseVoxels > 0)
    return options.denseVoxels;
  return std::clamp(perPoint * static_cast<std::int64_t>(std::min<std::size_t>(points, max)), min, max);
}

int affordableThreads(const BoundingBox& box, float voxelSize, const Workload& workload,
                      const MultiscaleOptions& options, int threads)
{
  const double limit = memoryLimit(options.maxMemory);
  int affordable = threads;
  while (affordable > 1 && predictedBytes(box, voxelSize, workload, options, affordable) > limit)
    --affordable;
  return affordable;
}

AxisOrder bandAxes(const GridSize& size)
{
  constexpr double worthwhile = 1.5;
  std::array<int, 3> byLength{0, 1, 2};
  const Eigen::Array3d sides(size.x, size.y, size.z);
  std::stable_sort(byLength.begin(), byLength.end(), [&](int a, int b) { return sides[a] < sides[b]; });
  const auto side = [&](int rank) { return sides[byLength[rank]]; };
  AxisOrder order;
  if (sides[0] * sides[1] > worthwhile * side(1) * side(0) || sides[1] * sides[2] > worthwhile * side(0) * side(2))
    order.axes = {byLength[1], byLength[0], byLength[2]};
  return order;
}

std::vector<Lattice> planLevels(const BoundingBox& box, float voxelSize, const Workload& workload,
                                const MultiscaleOptions& options)
{
  validate(options);
  if (!(voxelSize > 0))
    throw InvalidOption("multiscale.voxelSize = " + std::to_string(voxelSize) +
                        " must be above 0 where levels are planned");
  checkResources(box, voxelSize, workload, options);

  const Eigen::Vector3d corner = box.lower.cast<double>();
  const Eigen::Array3d extent = (box.upper - box.lower).cast<double>().array();
  const int padding = resolvedPadding(options);
  IndexBox voxels;
  voxels.lower = Eigen::Array3i::Constant(-padding);
  voxels.upper = (extent / voxelSize).ceil().cast<int>() + padding;
  std::vector<Lattice> levels;
  for (double spacing = voxelSize;; spacing *= 2) {
    levels.push_back(voxels.toLattice(corner, spacing));
    const GridSize size = levels.back().size;
    if (std::max({size.x, size.y, size.z}) <= coarsestSide)
      break;
    voxels.lower = halved(voxels.lower).floor().cast<int>();
    // Every point stays inside the outermost voxel centers.
    voxels.upper = halved(voxels.upper).ceil().cast<int>().max((extent / (2 * spacing) + .5).ceil().cast<int>());
  }
  std::reverse(levels.begin(), levels.end());
  requireCountable(withMargin(bandAxes(levels.back().size).toStored(levels.back().size)));
  checkTime(levels.back().size, workload);
  if (workload.solver.method == SolverMethod::cholesky || workload.solver.choleskyOnCoarsest)
    requireCholesky();
  return levels;
}

std::unique_ptr<Levels> beginLevels(const SolvedPiece& piece, float spacing, const Options& options,
                                    Execution& execution, int tiles)
{
  return std::make_unique<LevelSolver>(piece, spacing, options, execution, tiles);
}

MultiscaleResult regularize(const SolvedPiece& piece, float spacing, const Options& options, Execution& execution,
                            int tiles)
{
  LevelSolver levels(piece, spacing, options, execution, tiles);
  while (!levels.done())
    levels.solveNext();
  return levels.result();
}

} // namespace pcl::mrf
