#include "level_memory.h"

#include "band_solver.h"
#include "cholesky.h"
#include "multigrid.h"

#include <pcl/surface/mrf/point_observation.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace pcl {
namespace mrf {
namespace {

/// Peak bytes of a band per face of a voxel that the surface covers, besides what follows. With it the prediction came
/// within 6 % of what spheres of 1, 2, 4 and 8 points per face took, 10⁵ to 3·10⁶ points on one thread and on two.
constexpr double bytesPerFace = 310;

/// The first two bands take several steps, which keeps a direction, with more coarse grids.
constexpr double moreBytesPerFace = 50;
constexpr int bandsOfSeveralSteps = 2;

/// Voxels of a band per face.
constexpr double unknownsPerFace = 7.7;

/// Of the last dense level while bands are solved.
constexpr double bytesPerBackground = 8;

/// Of each band one entry per row of the box; about ten bands exist at a time.
constexpr double bytesPerRow = 40;

/// Bytes per observed voxel of a band: the observation, packed weights and targets of all grids, confidences.
constexpr double bytesPerObservedInBand = 53;

/// Voxels along an axis: positions are counted in voxels in single precision, to a sixteenth.
constexpr double mostVoxelsAlongAxis = 1 << 20;

/// Voxels whose cells hold points, per face of a voxel that the surface covers, where points lie as densely as they
/// like; a lone point occupies eight. (Measured on spheres with .25 to 16 points per face.)
constexpr double occupiedPerFace = 2.6, occupiedPerPoint = 8;

/// Of each of them the row that couples it with its neighbours, and its number.
constexpr double bytesPerOccupied = 27 * sizeof(float) + sizeof(std::int32_t);

/// Voxels of which a factor takes some tens of terabytes, whatever the prior.
constexpr double mostVoxelsOfFactor = 1e9;

/// Bytes per observed voxel while a level is solved: what is kept of it for the end, and for the first band.
constexpr double bytesPerObserved = 24;

double count(const GridSize& size)
{
  return static_cast<double>(size.count());
}

/// What points or observed voxels take on a level.
struct DataBytes {
  double samples = 0; ///< kept for all levels
  double system = 0;  ///< beside the arrays of one value per voxel
  double coarse = 0;  ///< of the same on the coarser grids of a solver
};

DataBytes dataBytes(const GridSize& size, double side, const Workload& workload)
{
  const double faces = workload.area / (side * side);
  if (workload.reach > 0) {
    const double observed = std::min(2 * workload.reach / side * faces, count(size));
    return {bytesPerObserved * observed, 0, 0};
  }
  const auto occupied = [&](double surface) {
    return occupiedPerFace * surface *
           (1 - std::exp(-occupiedPerPoint * workload.points / (occupiedPerFace * surface)));
  };
  const double samples = sizeof(PointSample) * workload.points;
  if (!(faces > 0))
    return {samples, 0, 0};
  DataBytes bytes;
  bytes.samples = samples;
  bytes.system = bytesPerOccupied * std::min(occupied(faces), count(size)) + samples;
  // Coarser levels, and the grids of a solver, merge the points: about one is left per occupied cell.
  for (double surface = faces / 4; surface > 1; surface /= 4) {
    const double merged = sizeof(PointSample) * std::min(workload.points, 1.5 * surface);
    bytes.samples += merged;
    bytes.coarse += bytesPerOccupied * occupied(surface) + merged;
  }
  return bytes;
}

/// Peak bytes while a dense level is solved.
double denseBytes(const GridSize& size, double side, const Workload& workload, bool isCoarsest, int threads)
{
  const Prior prior = workload.prior.prior;
  const bool pointwise = workload.reach == 0, weighted = workload.prior.energy == Energy::weighted;
  const DataBytes data = dataBytes(size, side, workload);
  // The field, the diagonal of the data term and its right-hand side, the voxels' weights.
  const double system = data.samples + data.system + sizeof(float) * count(size) * (3 + (weighted ? 1 : 0));
  const bool factorises =
      workload.solver.method == SolverMethod::cholesky || (isCoarsest && workload.solver.choleskyOnCoarsest);
  double solver = 0;
  if (factorises)
    solver = choleskyCost(size, prior, pointwise).bytes + choleskyBytesPerVoxel * count(size);
  if (workload.solver.method == SolverMethod::multigrid)
    solver =
        std::max(solver, data.coarse + 2 * sizeof(float) * count(size) +
                             MultigridPreconditioner<float>::predictedBytes(
                                 size, prior, weighted, pointwise, smootherDegree(workload.solver, prior), threads));
  else // the product, the diagonal and one more; the residual, the direction and its product
    solver = std::max(solver, 3 * sizeof(float) * count(size));
  return system + solver;
}

/// Peak bytes while the finest level is solved in a band. \param bands up to it
double bandBytes(const GridSize& lattice, double side, const Workload& workload, int bands, int threads)
{
  const GridSize size = bandAxes(lattice).toStored(lattice);
  const double faces = workload.area / (side * side), unknowns = unknownsPerFace * faces;
  const double data = workload.reach > 0 ? bytesPerObservedInBand * 2 * workload.reach / side * faces
                                         : sizeof(PointSample) * workload.points;
  const double perFace = bytesPerFace + (bands <= bandsOfSeveralSteps ? moreBytesPerFace : 0);
  return data + perFace * faces + bytesPerRow * size.y * size.z +
         bandWindowBytes(bandSize(size), unknowns, workload.prior.prior, workload.solver, threads);
}

GridSize wholeVoxels(const Eigen::Array3d& voxels)
{
  const Eigen::Array3i whole = voxels.ceil().cast<int>();
  return {whole.x(), whole.y(), whole.z()};
}

} // namespace

double bytesPerUnknown()
{
  return bytesPerFace / unknownsPerFace;
}

double predictedBytes(const BoundingBox& box, double side, const Workload& workload, const MultiscaleOptions& options,
                      int threads)
{
  const double padding = 2. * resolvedPadding(options);
  const Eigen::Array3d voxels = (box.upper - box.lower).cast<double>().array() / side + padding;
  constexpr double infinite = std::numeric_limits<double>::infinity();
  if (!(voxels.maxCoeff() <= mostVoxelsAlongAxis))
    return infinite;
  // Factors grow with voxels to the power of 4/3: what is beyond any memory is not worth being dissected.
  if (workload.solver.method == SolverMethod::cholesky && voxels.prod() > mostVoxelsOfFactor)
    return infinite;
  GridSize size = wholeVoxels(voxels);
  const GridSize finest = size;
  const auto isCoarsest = [&] { return std::max({size.x, size.y, size.z}) <= options.coarsestSide; };
  double voxelSide = side;
  int bands = 0;
  for (; !isCoarsest() && size.count() > options.denseVoxels; ++bands, voxelSide *= 2)
    size = size.coarsened();
  double most = bands == 0 ? 0 : bandBytes(finest, side, workload, bands, threads) + bytesPerBackground * count(size);
  for (;; voxelSide *= 2, size = size.coarsened()) {
    most = std::max(most, denseBytes(size, voxelSide, workload, isCoarsest(), threads));
    if (isCoarsest())
      return most;
  }
}

} // namespace mrf
} // namespace pcl
