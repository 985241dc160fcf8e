// SPDX-License-Identifier: BSD-3-Clause
#include "solver/grids.h"

#include "field/prior.h"
#include "solver/grid_solver.h"
#include "solver/linear_system.h"

#include <algorithm>
#include <cmath>

namespace pcl::mrf {
namespace {

/// Max voxels of a grid that needs no coarser one.
constexpr std::int64_t fewVoxels = 100;

/// Side, in voxels, of the cubes in which samples are merged for the coarse grids of a solver. With whole cells, as a
/// level itself has, the solver takes a third more steps.
constexpr float halfCell = .5f;

/// Weights of a level's observed voxels, packed. \param targets likewise
std::vector<float> packedWeights(const LevelObservation& observation, const VoxelSet& unknowns,
                                 std::vector<float>& targets)
{
  const Observation& observed = observation.voxels;
  const GridSize size = observed.lattice.size;
  std::vector<float> weights(unknowns.count(), 0);
  targets.assign(weights.size(), 0);
  for (std::size_t n = 0; n < observed.voxels.size(); ++n) {
    const Eigen::Array3i voxel = size.voxel(observed.voxels[n]) + gridMargin;
    const std::int64_t at = unknowns.find(voxel.x(), voxel.y(), voxel.z());
    if (at < 0)
      continue;
    weights[at] = static_cast<float>(dataWeight(observed.confidences[n], observation.prior.beta) *
                                     centerCoefficient(observation.prior.kind));
    targets[at] = observed.distances[n];
  }
  return weights;
}

/// The weights on a coarser grid: scale × the mean of the children's weights.
std::vector<float> coarsenedWeights(const VoxelSet& fine, const std::vector<float>& weights,
                                    const Refinement& refinement, float scale, const VoxelSet& coarse)
{
  std::vector<float> result(coarse.count(), 0);
  for (int z = 0; z < fine.size().z; ++z)
    fine.forRuns(z, [&](const Run& run, int x, int y) {
      for (int i = 0; i < run.count; ++i)
        if (const float weight = weights[fine.planeFirst(z) + run.first + i]; weight > 0)
          result[coarse.find(refinement.parent(x + i, 0), refinement.parent(y, 1), refinement.parent(z, 2))] +=
              scale / static_cast<float>(refinement.children) * weight;
    });
  return result;
}

/// \param voxelsOf voxelsOf(at, finer) makes the voxels of lattice `at`; finer: the next finer grid, null for the first
template <typename VoxelsOf>
std::vector<SolverGrid> makeGrids(const std::vector<Lattice>& lattices, std::size_t level, std::size_t depth,
                                  const LevelObservation& observation, Prior prior, bool areWhole,
                                  const VoxelsOf& voxelsOf)
{
  std::vector<SolverGrid> grids(depth + 1); // never resized: the data refer to the voxels
  const double scale = std::pow(4.0, order(prior));
  PointWeights weights = observation.weights;
  std::vector<float> voxelWeights;
  for (std::size_t n = 0; n <= depth; ++n) {
    const std::size_t at = level - n;
    SolverGrid& grid = grids[n];
    const SolverGrid* finer = n > 0 ? &grids[n - 1] : nullptr;
    if (at > 0)
      grid.refinement = Refinement(lattices[at - 1], lattices[at]);
    grid.isWhole = areWhole;
    grid.voxels = voxelsOf(at, finer);
    if (observation.samples) {
      if (finer) {
        const double share = priorConstants(prior, areWhole).coarseShare * scale / finer->refinement.children;
        weights = {weights.value * share, weights.gradient * share / 4};
      }
      const LevelSamples& samples = *observation.samples;
      grid.data = makePointData(finer ? samples.beneath[at] : samples.own[at], grid.voxels, weights,
                                lattices[at].spacing, areWhole);
      continue;
    }
    std::vector<float> targets; // the coarser grids have none
    voxelWeights =
        finer ? coarsenedWeights(finer->voxels, voxelWeights, finer->refinement, static_cast<float>(scale), grid.voxels)
              : packedWeights(observation, grid.voxels, targets);
    grid.data = makeVoxelData(grid.voxels, voxelWeights, std::move(targets));
  }
  return grids;
}

/// Makes the samples of all lattices before lattice `at`, which has its own already.
void coarsenFrom(std::size_t at, LevelSamples& samples, const std::vector<Lattice>& lattices, Execution& execution)
{
  for (; at > 0; --at) {
    const std::vector<PointSample>& finer = samples.beneath[at].empty() ? samples.own[at] : samples.beneath[at];
    samples.beneath[at - 1] =
        sortedByCells(coarsened(finer, lattices[at], lattices[at - 1], halfCell, execution), execution);
    samples.own[at - 1] = merge(samples.beneath[at - 1], 1, execution);
  }
}

} // namespace

std::size_t addCoarserGrids(std::vector<Lattice>& lattices)
{
  const std::size_t before = lattices.size();
  while (lattices.front().size.count() > fewVoxels && lattices.front().size.coarsened() != lattices.front().size) {
    Lattice coarse = lattices.front();
    coarse.size = coarse.size.coarsened();
    coarse.origin.array() += coarse.spacing / 2;
    coarse.spacing *= 2;
    lattices.insert(lattices.begin(), coarse);
  }
  return lattices.size() - before;
}

LevelSamples::LevelSamples(std::vector<PointSample> finest, const std::vector<Lattice>& lattices, Execution& execution)
    : own(lattices.size()), beneath(lattices.size())
{
  own.back() = std::move(finest);
  coarsenFrom(lattices.size() - 1, *this, lattices, execution);
}

LevelSamples LevelSamples::beneathFinest(const PointsOnLattice& seen, const std::vector<Lattice>& lattices,
                                         Execution& execution)
{
  const std::size_t last = lattices.size() - 2;
  LevelSamples samples;
  samples.own.resize(lattices.size());
  samples.beneath.resize(lattices.size());
  samples.beneath[last] = sortedByCells(toCoarsenedSamples(seen, lattices[last], halfCell, execution), execution);
  samples.own[last] = merge(samples.beneath[last], 1, execution);
  coarsenFrom(last, samples, lattices, execution);
  return samples;
}

VoxelSet wholeOf(const Lattice& lattice, Execution& execution)
{
  const GridSize inner = lattice.size;
  return VoxelSet(withMargin(inner), execution, [&](int z, MaskPlane& mask) {
    if (z >= gridMargin && z < gridMargin + inner.z)
      for (int y = gridMargin; y < gridMargin + inner.y; ++y)
        mask.setRange(gridMargin, gridMargin + inner.x, y);
  });
}

std::vector<SolverGrid> wholeGrids(const std::vector<Lattice>& lattices, std::size_t level,
                                   const LevelObservation& observation, Prior prior, Execution& execution)
{
  return makeGrids(lattices, level, level, observation, prior, true,
                   [&](std::size_t at, const SolverGrid*) { return wholeOf(lattices[at], execution); });
}

std::vector<SolverGrid> bandGrids(const std::vector<Lattice>& lattices, std::size_t level, VoxelSet unknowns,
                                  const LevelObservation& observation, Prior prior, std::size_t coarseGrids,
                                  Execution& execution)
{
  const auto voxelsOf = [&](std::size_t at, const SolverGrid* finer) {
    if (!finer)
      return std::move(unknowns);
    const GridSize size = withMargin(lattices[at].size);
    const VoxelSet parents = coarsened(finer->voxels, size, finer->refinement, execution);
    VoxelSet observed;
    if (observation.samples)
      observed = observedVoxels(observation.samples->own[at], size, execution);
    const auto fill = [&](int z, MaskPlane& mask) {
      parents.rasterize(z, mask);
      observed.rasterize(z, mask);
    };
    return VoxelSet(size, execution, fill, size.x - 1);
  };
  return makeGrids(lattices, level, std::min(coarseGrids, level), observation, prior, false, voxelsOf);
}

WholeLevel::WholeLevel(std::vector<Lattice> lattices, const std::vector<PointSample>& samples,
                       const PointWeights& weights, Prior prior, Execution& execution)
    : prior_(prior), lattices_(std::move(lattices))
{
  addCoarserGrids(lattices_);
  samples_ = LevelSamples(sortedByCells(samples, execution), lattices_, execution);
  observation_.samples = &samples_;
  observation_.weights = weights;
  grids_ = wholeGrids(lattices_, lattices_.size() - 1, observation_, prior_, execution);
}

SolveReport WholeLevel::solve(const SolverOptions& options, std::vector<float>& values, Execution& execution) const
{
  return solveWholeGrids(grids_, prior_, options, lattice().spacing, values, execution);
}

SolverOptions roughSolver(Prior prior, double tolerance)
{
  SolverOptions options;
  options.changeTolerance = tolerance;
  // Measured: a fifth less work than with the prior's own degree.
  if (prior != Prior::membrane)
    options.smootherDegree = 4;
  return options;
}

} // namespace pcl::mrf
