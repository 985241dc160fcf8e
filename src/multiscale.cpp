#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/multiscale.h>
#include <pcl/surface/mrf/point_observation.h>

#include "interpolation.h"
#include "memory.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>

namespace pcl {
namespace mrf {
namespace {

/// Peak bytes per voxel of the finest level while it is solved: the solver's vectors, its hierarchy, system and field.
constexpr double bytesPerVoxel = 72;

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start)
{
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Voxels [lower, upper) of a level, in multiples of its voxel side from the corner shared by all levels.
struct IndexBox {
  Eigen::Array3i lower = Eigen::Array3i::Zero(), upper = Eigen::Array3i::Zero();

  Lattice toLattice(const Eigen::Vector3d& corner, double spacing) const
  {
    Lattice lattice;
    const Eigen::Array3i size = upper - lower;
    lattice.size = {size.x(), size.y(), size.z()};
    lattice.spacing = spacing;
    lattice.origin = corner + spacing * (lower.cast<double>() + .5).matrix();
    return lattice;
  }
};

Eigen::Array3d halved(const Eigen::Array3i& index)
{
  return index.cast<double>() / 2;
}

/// Sides of the cubes, in voxels, of which a level sees one sample only.
constexpr float mergeSide = .5f;

/// The points as each level sees them, coarsest first: merged on all but the finest.
std::vector<std::vector<PointSample>> samplesOfLevels(const OrientedPoints& points,
                                                      const std::vector<Lattice>& lattices)
{
  std::vector<std::vector<PointSample>> result(lattices.size());
  result.back() = toSamples(points, lattices.back());
  for (std::size_t level = lattices.size() - 1; level > 0; --level) {
    const Lattice &fine = lattices[level], &coarse = lattices[level - 1];
    std::vector<PointSample> samples = result[level];
    const double ratio = fine.spacing / coarse.spacing;
    const Eigen::Vector3d shift = (fine.origin - coarse.origin) / coarse.spacing;
    for (PointSample& sample : samples)
      sample.position = (ratio * sample.position.cast<double>() + shift).cast<float>();
    result[level - 1] = merge(samples, mergeSide);
  }
  return result;
}

std::vector<float> denseConfidences(const Observation& observation)
{
  std::vector<float> confidences(static_cast<std::size_t>(observation.lattice.size.count()), 0);
  for (std::size_t v = 0; v < observation.voxels.size(); ++v)
    confidences[static_cast<std::size_t>(observation.voxels[v])] = observation.confidences[v];
  return confidences;
}

template <typename Value>
[[noreturn]] void refuse(const char* name, Value value, const char* range)
{
  std::ostringstream text;
  text << "multiscale." << name << " = " << value << " is outside its range " << range;
  throw InvalidOption(text.str());
}

/// \throw ResourceLimit if a box of this size cannot be solved within the limit
void checkMemory(const BoundingBox& box, float voxelSize, const MultiscaleOptions& options)
{
  const std::size_t limit = options.maxMemory > 0 ? options.maxMemory : availableMemory() / 10 * 8;
  const auto bytesFor = [&](double side) {
    const Eigen::Array3d voxels =
        (box.upper - box.lower).cast<double>().array() / side + 2 * resolvedPadding(options) + 2;
    return voxels.prod() * bytesPerVoxel * 8 / 7;
  };
  const double predicted = bytesFor(voxelSize);
  if (predicted <= static_cast<double>(limit))
    return;
  double fitting = voxelSize;
  while (bytesFor(fitting) > static_cast<double>(limit) && fitting < box.diagonal())
    fitting *= 1.05;
  std::ostringstream text;
  text.precision(3);
  text << "voxel size " << voxelSize << " would take " << predicted / (1 << 30) << " GiB, the limit is "
       << static_cast<double>(limit) / (1 << 30) << " GiB; a voxel size of " << fitting << " would fit";
  throw ResourceLimit(text.str());
}

} // namespace

void validate(const MultiscaleOptions& options)
{
  if (!(options.voxelSize >= 0) || !std::isfinite(options.voxelSize))
    refuse("voxelSize", options.voxelSize, "[0, inf), 0 = by the quality");
  if (options.padding != 0 && (options.padding < 2 || options.padding > 1000))
    refuse("padding", options.padding, "2..1000, 0 = chosen by a coarse solution");
  if (options.coarsestSide < 4 || options.coarsestSide > 256)
    refuse("coarsestSide", options.coarsestSide, "4..256");
}

int resolvedPadding(const MultiscaleOptions& options)
{
  return options.padding > 0 ? options.padding : leastPadding;
}

std::vector<Lattice> planLevels(const BoundingBox& box, float voxelSize, const MultiscaleOptions& options)
{
  validate(options);
  if (!(voxelSize > 0))
    refuse("voxelSize", voxelSize, "(0, inf)");
  checkMemory(box, voxelSize, options);

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
    if (std::max({size.x, size.y, size.z}) <= options.coarsestSide)
      break;
    voxels.lower = halved(voxels.lower).floor().cast<int>();
    voxels.upper = halved(voxels.upper).ceil().cast<int>();
  }
  std::reverse(levels.begin(), levels.end());
  return levels;
}

MultiscaleResult regularise(const OrientedPoints& points, const NeighbourSearch& search, float spacing,
                            const BoundingBox& volume, const ObservationOptions& observationOptions,
                            const PriorOptions& prior, const SolverOptions& solver, const MultiscaleOptions& options,
                            Execution& execution)
{
  validate(observationOptions);
  validate(prior);
  validate(solver);
  const float voxelSize = options.voxelSize > 0 ? options.voxelSize : spacingsPerVoxel(options.quality) * spacing;
  const float maxDistance = resolvedMaxDistance(observationOptions, spacing, voxelSize);
  const std::vector<Lattice> lattices = planLevels(volume, voxelSize, options);

  const bool atPoints = observationOptions.atPoints();
  std::vector<std::vector<PointSample>> samples;
  if (atPoints)
    samples = samplesOfLevels(points, lattices);

  double totalVoxels = 0, doneVoxels = 0;
  for (const Lattice& lattice : lattices)
    totalVoxels += static_cast<double>(lattice.size.count());

  MultiscaleResult result;
  std::vector<float> distances;
  for (std::size_t level = 0; level < lattices.size(); ++level) {
    const Lattice& lattice = lattices[level];
    const bool isCoarsest = level == 0, isFinest = level + 1 == lattices.size();
    LevelReport report;
    report.size = lattice.size;
    report.voxelSize = lattice.spacing;
    report.maxDistance = maxDistance;
    if (observationOptions.scaleWithLevel && !isFinest)
      report.maxDistance = std::max(maxDistance, static_cast<float>(1.5 * lattice.spacing));

    const double begin = doneVoxels / totalVoxels;
    doneVoxels += static_cast<double>(lattice.size.count());
    execution.beginStep(begin, doneVoxels / totalVoxels);

    const Clock::time_point observationStart = Clock::now();
    LinearSystem<float> system;
    std::vector<float> confidences;
    if (atPoints) {
      const double least = isFinest ? 0 : leastSmoothing * lattice.spacing;
      const double smoothing = std::max<double>(resolvedSmoothing(observationOptions, spacing), least);
      system.prior = {lattice.size, prior.prior, {}};
      system.data = makePointDataTerm<float>(
          lattice.size, std::move(samples[level]),
          pointWeights(prior.prior, smoothing, spacing, lattice.spacing, observationOptions.gradientWeight),
          lattice.spacing, execution);
      const std::vector<float>& diagonal = system.data->diagonal();
      report.observed = std::count_if(diagonal.begin(), diagonal.end(), [](float value) { return value > 0; });
    } else {
      const Observation observation =
          observe(points, search, lattice, spacing, report.maxDistance, observationOptions, execution);
      report.observed = static_cast<std::int64_t>(observation.voxels.size());
      if (isFinest)
        confidences = denseConfidences(observation);
      if (report.observed > 0)
        system = assemble<float>(observation, prior);
    }
    report.observationSeconds = secondsSince(observationStart);

    const Clock::time_point solverStart = Clock::now();
    if (isCoarsest)
      distances.assign(static_cast<std::size_t>(lattice.size.count()), 0);
    else
      distances = interpolateCubic(distances, lattices[level - 1], lattice, execution);
    // With a narrow reach the coarse levels of the paper's scheme may see nothing: their guess is then kept.
    if (report.observed > 0) {
      SolverOptions levelSolver = solver;
      if (isCoarsest && solver.choleskyOnCoarsest)
        levelSolver.method = SolverMethod::cholesky;
      report.solve = solve(system, levelSolver, lattice.spacing, distances, execution);
    }
    report.solverSeconds = secondsSince(solverStart);
    result.levels.push_back(report);
    execution.progress(1);

    if (isFinest) {
      if (report.observed == 0) {
        std::ostringstream text;
        text << "no voxel of side " << voxelSize << " is closer than dEmax = " << maxDistance
             << " to a point; choose a smaller voxel size or a larger dEmax";
        throw InvalidInput(text.str());
      }
      result.field = DistanceField(lattice, std::move(distances), std::move(confidences));
    }
  }
  return result;
}

} // namespace mrf
} // namespace pcl
