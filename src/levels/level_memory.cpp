// SPDX-License-Identifier: BSD-3-Clause
#include "levels/level_memory.h"

#include "base/memory.h"
#include "field/prior.h"
#include "levels/multiscale.h"
#include "levels/tiled_band.h"
#include "observation/point_observation.h"
#include "solver/cholesky.h"
#include "solver/grid_solver.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/options.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace pcl::mrf {
namespace {

/// Voxels of the finest band that a run may take whatever it has points, some seconds of work, and for each of them:
/// surfaces have about ten, open ones with all of the sheet around them twenty-five.
constexpr double unknownsOfAnyRun = 4e6, unknownsPerPoint = 2000;

/// Voxels that a method which visits each of them thousands of times takes on, and for each point of a larger cloud:
/// eight million kept conjugate gradients busy for more than a minute.
constexpr double slowVoxels = 4e6, slowVoxelsPerPoint = 100;

/// Peak bytes of a band per face of a voxel that the surface covers, besides what follows. With it the prediction came
/// within 6 % of what spheres of 1, 2, 4 and 8 points per face took, 10⁵ to 3·10⁶ points on one thread and on two.
constexpr double bytesPerFace = 310;

/// The first two bands take several steps, which keeps a direction, with more coarse grids.
constexpr double moreBytesPerFace = 50;
constexpr int bandsOfSeveralSteps = 2;

/// The only band is wider.
constexpr double moreBytesOfOnlyBand = 90;

/// Voxels of a band per face.
constexpr double unknownsPerFace = 7.7;

/// Of the last dense level while bands are solved.
constexpr double bytesPerBackground = 8;

/// Of each band one entry per row of the box; about ten bands exist at a time.
constexpr double bytesPerRow = 40;

/// What tiles keep of each unknown: what it was changed by, and then the field.
constexpr double bytesPerUnknownOfTiles = 16;

/// Bytes per observed voxel of a band: the observation, packed weights and targets of all grids, confidences.
constexpr double bytesPerObservedInBand = 53;

/// Voxels along an axis: positions are counted in voxels in single precision, to a sixteenth.
constexpr double maxVoxelsAlongAxis = 1 << 20;

/// Samples per face where coarser levels, and the grids of a solver, merge the points.
constexpr double mergedPerFace = 1.5;

/// Voxels whose cells hold points, per face of a voxel that the surface covers, where points lie as densely as they
/// like; a lone point occupies eight. (Measured on spheres with .25 to 16 points per face.)
constexpr double occupiedPerFace = 2.6, occupiedPerPoint = 8;

/// Of each of them what the plain system adds up of its row before the matrix is made.
constexpr double bytesPerOccupied = 27 * sizeof(double);

/// Of each of them the matrices of the cells on whole levels, 288 bytes for each of .4 cells, with all coarser grids.
constexpr double blockBytesPerOccupied = 155;

/// Voxels of which a factor takes some tens of terabytes, whatever the prior.
constexpr double maxVoxelsOfFactor = 1e9;

/// Bytes per observed voxel while a level is solved: what is kept of it for the end, and for the first band.
constexpr double bytesPerObserved = 24;

double count(const GridSize& size)
{
  return static_cast<double>(size.count());
}

/// Values per voxel of a whole level: the field, the residual and the direction; and of each of its grids: the iterate
/// before and after, the right-hand side, the scaling, neighbors and shares.
constexpr double valuesPerVoxel = 3, valuesPerGridVoxel = 6;

/// Of voxels that are observed: weights and targets.
constexpr double valuesPerObservedGridVoxel = 2;

/// A plain system in double precision: the field, the right-hand side, where rows begin and the solver's vectors; and
/// each entry of its matrix, which is there nearly twice while it is made. (Measured on 100,000 voxels.)
constexpr double bytesPerPlainVoxel = 37, bytesPerEntry = 22.4;

/// The voxels that points occupy on a level.
double occupiedVoxels(const GridSize& size, double side, const Workload& workload)
{
  const double surface = occupiedPerFace * workload.area / (side * side);
  return surface > 0 ? std::min(count(size), surface * (1 - std::exp(-occupiedPerPoint * workload.points / surface)))
                     : 0;
}

/// What is kept of the data for all levels.
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

/// Of the grids of a whole level and the windows that sweep over them.
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

/// The prior that couples the voxels as the energy does.
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
    bytes += (bytesPerPlainVoxel + bytesPerEntry * entriesPerVoxel(coupled, false)) * count(size) +
             bytesPerOccupied * occupied;
  }
  if (factorizes)
    bytes += choleskyBytes(size, coupled, pointwise);
  return bytes;
}

/// The largest part of a level that is solved at a time.
double shareOfTile(int planes, int tiles)
{
  return std::min(1., 1. / tiles + 2. * tileHalo / planes);
}

/// Peak bytes while the finest level is solved in a band. \param bands up to it
double bandBytes(const GridSize& lattice, double side, const Workload& workload, int bands, int threads)
{
  const GridSize size = bandAxes(lattice).toStored(lattice);
  const double faces = workload.area / (side * side), unknowns = unknownsPerFace * faces;
  const double data = workload.reach > 0 ? bytesPerObservedInBand * 2 * workload.reach / side * faces
                                         : sizeof(PointSample) * workload.points;
  const double perFace =
      bytesPerFace + (bands <= bandsOfSeveralSteps ? moreBytesPerFace : 0) + (bands == 1 ? moreBytesOfOnlyBand : 0);
  return data + perFace * faces + bytesPerRow * size.y * size.z +
         GridOperator::sweepBytes(withMargin(size), unknowns, order(workload.prior.kind),
                                  smootherDegree(workload.solver, workload.prior.kind, false), threads);
}

/// Voxels of the finest level along each axis.
Eigen::Array3d finestVoxels(const BoundingBox& box, double side, const MultiscaleOptions& options)
{
  return ((box.upper - box.lower).cast<double>().array() / side + 2. * resolvedPadding(options)).ceil();
}

/// Factors grow with voxels to the power of 4/3: what is beyond any memory is not worth being dissected.
bool isBeyondFactors(const Eigen::Array3d& voxels, const Workload& workload)
{
  return workload.solver.method == SolverMethod::cholesky && voxels.prod() > maxVoxelsOfFactor;
}

GridSize wholeVoxels(const Eigen::Array3d& voxels)
{
  const Eigen::Array3i whole = voxels.cast<int>();
  return {whole.x(), whole.y(), whole.z()};
}

bool isCoarsest(const GridSize& size)
{
  return std::max({size.x, size.y, size.z}) <= coarsestSide;
}

/// Peak bytes while the last two levels are solved, in bands, the last in tiles.
double tiledBytes(const GridSize& lattice, double side, const Workload& workload, int bands, int threads)
{
  const GridSize size = bandAxes(lattice).toStored(lattice);
  const double faces = workload.area / (side * side), unknowns = unknownsPerFace * faces;
  const double sweep = GridOperator::sweepBytes(withMargin(size), unknowns, order(workload.prior.kind),
                                                smootherDegree(workload.solver, workload.prior.kind, false), threads);
  Workload before = workload;
  before.points = std::min(workload.points, mergedPerFace * faces / 4);
  const double finest = finestBandBytes(unknowns, workload.points, size.z, mostTiles(size.z)) + sweep +
                        bytesPerRow * size.y * size.z + sizeof(PointSample) * before.points;
  return std::max(finest, bandBytes(lattice.coarsened(), 2 * side, before, bands - 1, threads));
}

/// Seconds in which a factorization cannot be cancelled; 0 without any.
double predictedCholeskySeconds(const BoundingBox& box, double side, const Workload& workload,
                                const MultiscaleOptions& options)
{
  const bool isFinest = workload.solver.method == SolverMethod::cholesky;
  if (!isFinest && !workload.solver.choleskyOnCoarsest)
    return 0;
  const Eigen::Array3d voxels = finestVoxels(box, side, options);
  if (!(voxels.maxCoeff() <= maxVoxelsAlongAxis) || isBeyondFactors(voxels, workload))
    return std::numeric_limits<double>::infinity();
  GridSize size = wholeVoxels(voxels);
  while (!isFinest && !isCoarsest(size))
    size = size.coarsened();
  return choleskySeconds(size, couplingOf(workload), workload.reach == 0);
}

} // namespace

double finestBandBytes(double unknowns, double points, int planes, int tiles)
{
  const double whole = bytesPerFace / unknownsPerFace * unknowns + sizeof(PointSample) * points;
  return tiles == 1 ? whole : shareOfTile(planes, tiles) * whole + bytesPerUnknownOfTiles * unknowns;
}

int mostTiles(int planes)
{
  return std::max(2, planes / (2 * tileHalo));
}

Workload workloadOf(std::size_t points, float spacing, const PriorOptions& prior)
{
  // The area that a point stands for, in squared spacings: the mean distance to the nearest of points at random.
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

double predictedBytes(const BoundingBox& box, double side, const Workload& workload, const MultiscaleOptions& options,
                      int threads)
{
  const Eigen::Array3d voxels = finestVoxels(box, side, options);
  constexpr double infinite = std::numeric_limits<double>::infinity();
  if (!(voxels.maxCoeff() <= maxVoxelsAlongAxis) || isBeyondFactors(voxels, workload))
    return infinite;
  GridSize size = wholeVoxels(voxels);
  const GridSize finest = size;
  double voxelSide = side;
  int bands = 0;
  for (; !isCoarsest(size) && size.count() > options.denseVoxels; ++bands, voxelSide *= 2)
    size = size.coarsened();
  const bool isTiled = workload.isTiled && mayBeTiled(workload, bands);
  double max = bands == 0 ? 0
                          : (isTiled ? tiledBytes : bandBytes)(finest, side, workload, bands, threads) +
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
  std::ostringstream text;
  text.precision(3);
  text << "voxel size " << voxelSize << " would take ";
  if (predicted > limit)
    text << predicted / (1 << 30) << " GiB, the limit is " << limit / (1 << 30) << " GiB";
  else
    text << "cholesky some " << seconds << " s, in which the run could not be cancelled";
  text << "; a voxel size of " << fitting << " would fit";
  if (seconds > 0)
    text << ", and so may another solver";
  throw ResourceLimit(text.str());
}

void checkTime(const GridSize& finest, const Workload& workload)
{
  const double voxels = static_cast<double>(finest.count());
  if (!solvesPlainly(workload.solver, workload.prior, workload.reach == 0) ||
      workload.solver.method == SolverMethod::cholesky ||
      voxels <= std::max(slowVoxels, slowVoxelsPerPoint * workload.points))
    return;
  std::ostringstream text;
  text.precision(3);
  text << "solver " << (isIcm(workload.solver.method) ? "icm" : "cg") << " would visit " << voxels << " voxels around "
       << workload.points
       << " points thousands of times; take multigrid with the energy joint, larger voxels or less padding";
  throw ResourceLimit(text.str());
}

void checkSurface(double unknowns, double bytes, std::size_t points, double voxelSize, double limit)
{
  const double sound = std::max(unknownsOfAnyRun, unknownsPerPoint * static_cast<double>(points));
  const double excess = std::max(unknowns / sound, bytes / limit);
  if (excess <= 1)
    return;
  std::ostringstream text;
  text.precision(3);
  text << "voxel size " << voxelSize << " would take " << unknowns << " voxels along the surface";
  if (bytes / limit >= unknowns / sound)
    text << ", " << bytes / (1 << 30) << " GiB, the limit is " << limit / (1 << 30) << " GiB";
  else
    text << " through " << points << " points, which say nothing about most of it";
  // Faces grow with the square of the voxel size; a quarter more for what coarser levels see otherwise.
  text << "; a voxel size of " << 1.25 * voxelSize * std::sqrt(excess) << " would do";
  throw ResourceLimit(text.str());
}

} // namespace pcl::mrf
