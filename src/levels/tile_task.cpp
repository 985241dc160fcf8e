// SPDX-License-Identifier: BSD-3-Clause
#include "levels/tile_task.h"

#include "tiles/tasks.h"

#include <utility>

BOOST_IS_BITWISE_SERIALIZABLE(pcl::mrf::PointSample)

namespace pcl::mrf {
namespace {

/// Sets the change of the tile's own planes: the solution minus the interpolation.
void setChange(const TileInput& tile, const LevelField& field, TileResult& result, Execution& execution)
{
  const int begin = tile.tile.step.begin, end = tile.tile.step.end;
  result.changed = cutPlanes(field.unknowns, begin, end - begin, execution);
  result.change.resize(result.changed.count());
  const PackedValues guess = interpolated(tile.coarse, field.lattice, field.unknowns, execution);
  const std::int64_t before = field.unknowns.planeFirst(begin);
  for (int z = begin; z < end; ++z)
    forEachPair(field.unknowns, field.support, z, [&](std::int64_t inner, std::int64_t outer, std::int64_t count) {
      for (std::int64_t i = 0; i < count; ++i)
        result.change[inner - before + i] = field.values[outer + i] - guess[inner + i];
    });
}

TileResult solve(TileInput input, Execution& execution)
{
  if (input.plan.threads == 0)
    input.plan.threads = execution.threads();
  const LevelSamples samples(std::move(input.samples), input.lattices, execution);
  LevelObservation observation;
  observation.samples = &samples;
  observation.weights = input.weights;
  LevelReport report;
  LevelField field = solveNarrowBand({input.lattices, 1, observation, input.prior, &input.tile}, input.coarse,
                                     input.plan, input.solver, report, execution);
  TileResult result;
  setChange(input, field, result, execution);
  result.step = input.tile.step;
  result.observed = std::move(field.observed);
  result.solve = std::move(report.solve);
  return result;
}

} // namespace

template <typename Archive>
void serialize(Archive& archive, LevelField& field, unsigned)
{
  serializeAll(archive, field.lattice, field.unknowns, field.support, field.values, field.left);
}

template <typename Archive>
void serialize(Archive& archive, PointWeights& weights, unsigned)
{
  serializeAll(archive, weights.value, weights.gradient);
}

/// The threads are left out: the process that solves the tile has its own.
template <typename Archive>
void serialize(Archive& archive, LevelPlan& plan, unsigned)
{
  serializeAll(archive, plan.steps, plan.coarseGrids);
}

template <typename Archive>
void serialize(Archive& archive, SolverOptions& options, unsigned)
{
  serializeAll(archive, options.method, options.maxIterations, options.changeTolerance, options.seed,
               options.residualTolerance, options.smootherDegree, options.choleskyOnCoarsest);
}

template <typename Archive>
void serialize(Archive& archive, TileStep& step, unsigned)
{
  serializeAll(archive, step.begin, step.end, step.decrease, step.curvature, step.length);
}

template <typename Archive>
void serialize(Archive& archive, SolveReport& report, unsigned)
{
  serializeAll(archive, report.method, report.iterations, report.relativeResidual, report.remainingChange,
               report.remainingChangeOfFillings, report.converged);
}

template <typename Archive>
void serialize(Archive& archive, TileInput& tile, unsigned)
{
  serializeAll(archive, tile.lattices, tile.coarse, tile.samples, tile.weights, tile.prior, tile.plan, tile.solver,
               tile.tile.isCutBelow, tile.tile.isCutAbove, tile.tile.found, tile.tile.step.begin, tile.tile.step.end);
}

template <typename Archive>
void serialize(Archive& archive, TileResult& result, unsigned)
{
  serializeAll(archive, result.changed, result.change, result.observed, result.step, result.solve);
}

VoxelSet cutPlanes(const VoxelSet& set, int first, int count, Execution& execution)
{
  const GridSize size{set.size().x, set.size().y, count};
  return VoxelSet(size, execution, [&](int z, MaskPlane& mask) { set.rasterize(z + first, mask); });
}

void solveTiles(int count, const std::function<TileInput(int n)>& makeInput,
                const std::function<void(int n, TileResult result)>& use, Execution& execution)
{
  forTasks<TileInput, TileResult>(tileKind, solve, count, makeInput, use, execution);
}

std::string solveTile(std::string input, Execution& execution)
{
  return doneAsBytes<TileInput, TileResult>(solve, std::move(input), execution);
}

} // namespace pcl::mrf
