// SPDX-License-Identifier: BSD-3-Clause
#include "levels/level_memory.h"

#include "base/memory.h"
#include "base/text.h"
#include "field/prior.h"
#include "levels/tiled_band.h"
#include "observation/point_observation.h"
#include "solver/cholesky.h"
#include "solver/grid_solver.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

namespace pcl::mrf {
namespace {

/// Max unknowns of the finest band: `unknownsOfAnyRun`, some seconds of work, or `unknownsPerPoint` times the number of
/// points if that is more. Surfaces have about ten per point, open ones with all of the sheet around them twenty-five.
constexpr double unknownsOfAnyRun = 4e6, unknownsPerPoint = 2000;

/// Max voxels for ICM and conjugate gradients, which visit each thousands of times (more than a minute for eight
/// million): `slowVoxels`, or `slowVoxelsPerPoint` times the number of points if that is more.
constexpr double slowVoxels = 4e6, slowVoxelsPerPoint = 100;

/// Peak bytes of a band per face (area of the surface / area of a voxel's face), besides those below. Predictions were
/// within 6 % for spheres of 1, 2, 4 and 8 points per face, 10⁵ to 3·10⁶ points, on one thread and on two.
constexpr double bytesPerFace = 310;

/// More bytes per face of the first two bands: they take several steps, which keep a direction, with more coarse grids.
constexpr double moreBytesPerFace = 50;
constexpr int bandsOfSeveralSteps = 2;

/// More bytes per face of a level that is the only one in a band, which is wider.
constexpr double moreBytesOfOnlyBand = 90;

/// Unknowns of a band per face.
constexpr double unknownsPerFace = 7.7;

/// Bytes per voxel of the last dense level, which is kept while bands are solved.
constexpr double bytesPerBackground = 8;

/// Bytes per row of a grid: each band has one entry per row, and about ten bands exist at a time.
constexpr double bytesPerRow = 40;

/// Bytes per unknown of the whole level that tiles keep: the changes, and then the field.
constexpr double bytesPerUnknownOfTiles = 16;

/// Bytes per observed voxel of a band: the observation, packed weights and targets of all grids, confidences.
constexpr double bytesPerObservedInBand = 53;

/// Max voxels along an axis: up to there, positions in voxels in single precision are accurate to a sixteenth.
constexpr double maxVoxelsAlongAxis = 1 << 20;

/// Samples per face on coarser levels and on the coarse grids of a solver, where points are merged.
constexpr double mergedPerFace = 1.5;

/// Occupied voxels, those of cells that hold points: at most `occupiedPerFace` per face however dense the points are,
/// and `occupiedPerPoint` around a lone point. (Measured on spheres with .25 to 16 points per face.)
constexpr double occupiedPerFace = 2.6, occupiedPerPoint = 8;

/// Bytes per occupied voxel of the sums for its row that a plain system makes before the matrix.
constexpr double bytesPerOccupied = 27 * sizeof(double);

/// Bytes per occupied voxel of a whole level for the matrices of its cells, .4 per voxel, and of all coarser grids'.
constexpr double blockBytesPerOccupied = 155;

/// Number of voxels whose factor takes some tens of terabytes, whatever the prior.
constexpr double maxVoxelsOfFactor = 1e9;

/// Bytes per observed voxel while a level is solved: the observation that is kept for the result and the first band.
constexpr double bytesPerObserved = 24;

double count(const GridSize& size)
{
  return static_cast<double>(size.count());
}

/// Values per voxel of a whole level: the field, the residual and the direction (valuesPerVoxel); and per voxel of each
/// of its grids: iterate before and after, right-hand side, scaling, neighbors and shares (valuesPerGridVoxel).
constexpr double valuesPerVoxel = 3, valuesPerGridVoxel = 6;

/// More values per voxel of each grid where voxels are observed: weights and targets.
constexpr double valuesPerObservedGridVoxel = 2;

/// A plain system in double precision: bytes per voxel (field, right-hand side, row starts, vectors of the solver) and
/// per entry of the matrix, which exists nearly twice while it is made. (Measured on 100,000 voxels.)
constexpr double bytesPerPlainVoxel = 37, bytesPerEntry = 22.4;

/// The number of voxels that points occupy on a level.
double occupiedVoxels(const GridSize& size, double side, const Workload& workload)
{
  const double surface = occupiedPerFace * workload.area / (side * side);
  return surface > 0 ? std::min(count(size), surface * (1 - std::exp(-occupiedPerPoint * workload.points / surface)))
                     : 0;
}

/// Bytes of the data: the samples of all levels, or the observed voxels of this one.
double dataBytes(const GridSize& size, double side, const Workload& workload)
{
  const double faces = workload.area / (side * side);
  if (workload.reach > 0)
    return bytesPerObserved * std::min(2 * workload.reach / side * faces, count(size));
  double samples = workload.isTiled ? 0 : workload.points;
  for (double surface = faces / 4; surface > 1; surface /= 4)
    samples += std::min(workload.points, mergedPerFace * surface);
  return sizeof(PointSample) * samples;
}

/// Bytes of the grids of a whole level and of the windows that sweep over them.
double gridBytes(const GridSize& size, const Workload& workload, int threads)
{
  const Prior prior = workload.prior.kind;
  const double values = valuesPerGridVoxel + (workload.reach > 0 ? valuesPerObservedGridVoxel : 0);
  double bytes = 0;
  const int degree = smootherDegree(workload.solver, prior, true);
  for (GridSize grid = size;; grid = grid.coarsened()) {
    bytes += sizeof(float) * values * count(grid);
    if (grid == size)
      bytes += GridOperator::sweepBytes(withMargin(grid), count(grid), order(prior), degree, threads);
    if (grid.coarsened() == grid)
      return bytes;
  }
}

/// The prior whose operator couples the same voxels as the energy.
Prior couplingOf(const Workload& workload)
{
  const PriorOptions& prior = workload.prior;
  return prior.energy == Energy::paper && prior.kind == Prior::thinPlate ? Prior::triharmonic : prior.kind;
}

/// Peak bytes while a dense level is solved.
double denseBytes(const GridSize& size, double side, const Workload& workload, bool isCoarsest, int threads)
{
  const bool pointwise = workload.reach == 0;
  const Prior coupled = couplingOf(workload);
  const bool factorizes =
      workload.solver.method == SolverMethod::cholesky || (isCoarsest && workload.solver.choleskyOnCoarsest);
  const bool isPlain = solvesPlainly(workload.solver, workload.prior, pointwise);
  const double occupied = pointwise ? occupiedVoxels(size, side, workload) : 0;
  double bytes = dataBytes(size, side, workload) + sizeof(float) * valuesPerVoxel * count(size);
  if (!isPlain)
    bytes += gridBytes(size, workload, threads) + blockBytesPerOccupied * occupied;
  if (isPlain || factorizes) {
    const double entries = entriesPerVoxel(coupled, false), atPoints = entriesPerVoxel(coupled, true) - entries;
    bytes += (bytesPerPlainVoxel + bytesPerEntry * entries) * count(size) +
             (bytesPerOccupied + bytesPerEntry * atPoints) * occupied;
  }
  if (factorizes)
    bytes += choleskyBytes(size, coupled, pointwise);
  return bytes;
}

/// Bytes of a band's rows, and of the windows that sweep over them.
double rowBytes(const GridSize& size, double unknowns, const Workload& workload, int threads)
{
  return bytesPerRow * size.y * size.z +
         GridOperator::sweepBytes(withMargin(size), unknowns, order(workload.prior.kind),
                                  smootherDegree(workload.solver, workload.prior.kind, false), threads);
}

/// Peak bytes while a level is solved in a band. \param bands number of levels in bands, up to this one
double bandBytes(const GridSize& lattice, double side, const Workload& workload, int bands, int threads)
{
  const GridSize size = bandAxes(lattice).toStored(lattice);
  const double faces = workload.area / (side * side), unknowns = unknownsPerFace * faces;
  const double data = workload.reach > 0 ? bytesPerObservedInBand * 2 * workload.reach / side * faces
                                         : sizeof(PointSample) * workload.points;
  const double perFace =
      bytesPerFace + (bands <= bandsOfSeveralSteps ? moreBytesPerFace : 0) + (bands == 1 ? moreBytesOfOnlyBand : 0);
  return data + perFace * faces + rowBytes(size, unknowns, workload, threads);
}

/// The finest level; none if its positions would be inaccurate, or if it is factorized and the factor, which grows with
/// voxels to the power of 4/3, is beyond any memory: no dissection is needed then.
std::optional<GridSize> finestLevel(const BoundingBox& box, double side, const Workload& workload,
                                    const MultiscaleOptions& options)
{
  const Eigen::Array3d voxels =
      ((box.upper - box.lower).cast<double>().array() / side + 2. * resolvedPadding(options)).ceil();
  if (!(voxels.maxCoeff() <= maxVoxelsAlongAxis) ||
      (workload.solver.method == SolverMethod::cholesky && voxels.prod() > maxVoxelsOfFactor))
    return {};
  const Eigen::Array3i whole = voxels.cast<int>();
  return GridSize{whole.x(), whole.y(), whole.z()};
}

bool isCoarsest(const GridSize& size)
{
  return std::max({size.x, size.y, size.z}) <= coarsestSide;
}

/// Peak bytes while the last two levels are solved in bands, the last one in tiles.
double tiledBytes(const GridSize& lattice, double side, const Workload& workload, int bands, int threads)
{
  const GridSize size = bandAxes(lattice).toStored(lattice);
  const double faces = workload.area / (side * side), unknowns = unknownsPerFace * faces;
  Workload before = workload;
  before.points = std::min(workload.points, mergedPerFace * faces / 4);
  const double finest =
      finestBandBytes(size, unknowns, workload, maxTiles(size.z), threads) + sizeof(PointSample) * before.points;
  return std::max(finest, bandBytes(lattice.coarsened(), 2 * side, before, bands - 1, threads));
}

std::string gigabytes(double needed, double left)
{
  return textOf(3, needed / (1 << 30), " GiB beside the points, ", left / (1 << 30), " GiB are left");
}

/// Seconds of the factorization, in which the run cannot be cancelled; 0 if there is none.
double predictedCholeskySeconds(const BoundingBox& box, double side, const Workload& workload,
                                const MultiscaleOptions& options)
{
  const bool isFinest = workload.solver.method == SolverMethod::cholesky;
  if (!isFinest && !workload.solver.choleskyOnCoarsest)
    return 0;
  std::optional<GridSize> size = finestLevel(box, side, workload, options);
  if (!size)
    return std::numeric_limits<double>::infinity();
  while (!isFinest && !isCoarsest(*size))
    size = size->coarsened();
  return choleskySeconds(*size, couplingOf(workload), workload.reach == 0);
}

} // namespace

double finestBandBytes(const GridSize& size, double unknowns, const Workload& workload, int tiles, int threads)
{
  const double whole = bytesPerFace / unknownsPerFace * unknowns + sizeof(PointSample) * workload.points;
  const double shareOfTile = std::min(1., 1. / tiles + 2. * tileHalo / size.z); // with its halos
  return (tiles == 1 ? whole : shareOfTile * whole + bytesPerUnknownOfTiles * unknowns) +
         rowBytes(size, unknowns, workload, threads);
}

int maxTiles(int planes)
{
  return std::max(2, planes / (2 * tileHalo));
}

Workload workloadOf(std::size_t points, float spacing, const PriorOptions& prior)
{
  // Area per point in squared spacings: the spacing is the mean distance to the nearest of random points.
  constexpr double areaPerPoint = 4;
  Workload workload;
  workload.points = static_cast<double>(points);
  workload.area = areaPerPoint * spacing * spacing * workload.points;
  workload.prior = prior;
  return workload;
}

bool mayBeTiled(const Workload& workload, int bands)
{
  return bands > 1 && workload.reach == 0 && workload.solver.maxIterations <= 1;
}

std::int64_t maxDenseVoxels(const MultiscaleOptions& options, const Workload& workload)
{
  return solvesPlainly(workload.solver, workload.prior, workload.reach == 0)
             ? std::numeric_limits<std::int64_t>::max()
             : resolvedDenseVoxels(options, static_cast<std::size_t>(workload.points));
}

double predictedBytes(const BoundingBox& box, double side, const Workload& workload, const MultiscaleOptions& options,
                      int threads)
{
  const std::optional<GridSize> finest = finestLevel(box, side, workload, options);
  if (!finest)
    return std::numeric_limits<double>::infinity();
  GridSize size = *finest;
  double voxelSide = side;
  int bands = 0;
  const std::int64_t denseVoxels = maxDenseVoxels(options, workload);
  for (; !isCoarsest(size) && size.count() > denseVoxels; ++bands, voxelSide *= 2)
    size = size.coarsened();
  const bool isTiled = workload.isTiled && mayBeTiled(workload, bands);
  double max = bands == 0 ? 0
                          : (isTiled ? tiledBytes : bandBytes)(*finest, side, workload, bands, threads) +
                                bytesPerBackground * count(size);
  for (;; voxelSide *= 2, size = size.coarsened()) {
    max = std::max(max, denseBytes(size, voxelSide, workload, isCoarsest(size), threads));
    if (isCoarsest(size))
      return max;
  }
}

void checkResources(const BoundingBox& box, float voxelSize, const Workload& workload, const MultiscaleOptions& options)
{
  const double limit = memoryLimit(options.maxMemory);
  Workload tiled = workload;
  tiled.isTiled = true;
  const auto bytesFor = [&](double side) {
    return std::min(predictedBytes(box, side, workload, options, 1), predictedBytes(box, side, tiled, options, 1));
  };
  const auto secondsFor = [&](double side) { return predictedCholeskySeconds(box, side, workload, options); };
  const double predicted = bytesFor(voxelSize), seconds = secondsFor(voxelSize);
  if (predicted <= limit && seconds <= maxCholeskySeconds)
    return;
  double fitting = voxelSize;
  while ((bytesFor(fitting) > limit || secondsFor(fitting) > maxCholeskySeconds) && fitting < box.diagonal())
    fitting *= 1.05;
  const std::string excess = predicted > limit
                                 ? gigabytes(predicted, limit)
                                 : textOf(3, "cholesky some ", seconds, " s, in which the run could not be cancelled");
  throw ResourceLimit(textOf(3, "voxel size ", voxelSize, " would take ", excess, "; a voxel size of ", fitting,
                             " would fit", seconds > 0 ? ", and so may another solver" : ""));
}

void checkTime(const GridSize& finest, const Workload& workload)
{
  const double voxels = static_cast<double>(finest.count());
  if (!solvesPlainly(workload.solver, workload.prior, workload.reach == 0) ||
      workload.solver.method == SolverMethod::cholesky ||
      voxels <= std::max(slowVoxels, slowVoxelsPerPoint * workload.points))
    return;
  throw ResourceLimit(
      textOf(3, "solver ", isIcm(workload.solver.method) ? "icm" : "cg", " would visit ", voxels, " voxels around ",
             workload.points,
             " points thousands of times; take multigrid with the energy joint, larger voxels or less padding"));
}

void checkSurface(double unknowns, double bytes, std::size_t points, double voxelSize, double limit)
{
  const double sound = std::max(unknownsOfAnyRun, unknownsPerPoint * static_cast<double>(points));
  const double excess = std::max(unknowns / sound, bytes / limit);
  if (excess <= 1)
    return;
  const std::string why = bytes / limit >= unknowns / sound
                              ? ", " + gigabytes(bytes, limit)
                              : textOf(3, " through ", points, " points, which say nothing about most of it");
  // Faces become fewer with the square of the voxel size. A quarter more, as coarser levels may see another surface.
  throw ResourceLimit(textOf(3, "voxel size ", voxelSize, " would take ", unknowns, " voxels along the surface", why,
                             "; a voxel size of ", 1.25 * voxelSize * std::sqrt(excess), " would do"));
}

} // namespace pcl::mrf
