#include "level_memory.h"

#include "cholesky.h"
#include "multigrid.h"

#include <pcl/surface/mrf/point_observation.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace pcl {
namespace mrf {
namespace {

/// Peak bytes of a band, per face of a voxel that the surface covers, and per voxel of a plane for the windows of each
/// thread. With the points and what was made of them before: the peaks of 1, 3 and 30 million points on two threads,
/// and of 3 million on one, came within a tenth.
constexpr double bytesPerFace = 285, bytesPerWindowVoxel = 250;

/// The dense levels beneath the bands, per voxel that they may have: a level's own and its coarser ones'.
constexpr double bytesPerDenseVoxel = 72;

/// Of each band one entry per row of the box; about ten bands exist at a time.
constexpr double bytesPerRow = 40;

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
  double samples = 0;  ///< kept for all levels
  double system = 0;   ///< beside the arrays of one value per voxel
  double coarse = 0;   ///< of the same on the coarser grids of a solver
};

DataBytes dataBytes(const GridSize& size, double side, const Workload& workload)
{
  const double faces = workload.area / (side * side);
  if (workload.reach > 0) {
    const double observed = std::min(2 * workload.reach / side * faces, count(size));
    return {bytesPerObserved * observed, 0, 0};
  }
  const auto occupied = [&](double surface) {
    return occupiedPerFace * surface * (1 - std::exp(-occupiedPerPoint * workload.points / (occupiedPerFace * surface)));
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
    solver = std::max(solver, data.coarse + 2 * sizeof(float) * count(size) +
                                  MultigridPreconditioner<float>::predictedBytes(
                                      size, prior, weighted, pointwise, smootherDegree(workload.solver, prior),
                                      threads));
  else // the product, the diagonal and one more; the residual, the direction and its product
    solver = std::max(solver, 3 * sizeof(float) * count(size));
  return system + solver;
}

GridSize wholeVoxels(const Eigen::Array3d& voxels)
{
  const Eigen::Array3i whole = voxels.ceil().cast<int>();
  return {whole.x(), whole.y(), whole.z()};
}

} // namespace

/// The bytes per face, shared out to the voxels of a band: 7.5 per face.
const double bytesPerUnknown = bytesPerFace / 7.5;

double predictedBytes(const BoundingBox& box, double side, const Workload& workload, const MultiscaleOptions& options,
                      int threads)
{
  const double padding = 2. * resolvedPadding(options);
  const Eigen::Array3d voxels = (box.upper - box.lower).cast<double>().array() / side + padding;
  constexpr double infinite = std::numeric_limits<double>::infinity();
  if (!(voxels.maxCoeff() <= mostVoxelsAlongAxis))
    return infinite;
  GridSize size = wholeVoxels(voxels);
  if (voxels.prod() > static_cast<double>(options.denseVoxels)) {
    const Eigen::Array3d stored = bandAxes(size).toStored(voxels);
    const double windows = bytesPerWindowVoxel * threads * stored.x() * stored.y(),
                 rows = bytesPerRow * stored.y() * stored.z();
    return bytesPerDenseVoxel * static_cast<double>(options.denseVoxels) + windows + rows +
           workload.area / (side * side) * bytesPerFace;
  }
  double most = 0;
  for (double voxelSide = side;; voxelSide *= 2) {
    const bool isCoarsest = std::max({size.x, size.y, size.z}) <= options.coarsestSide;
    // Factors grow with voxels to the power of 4/3: what is beyond any memory is not worth being dissected.
    if (workload.solver.method == SolverMethod::cholesky && count(size) > mostVoxelsOfFactor)
      return infinite;
    most = std::max(most, denseBytes(size, voxelSide, workload, isCoarsest, threads));
    if (isCoarsest)
      return most;
    size = size.coarsened();
  }
}

} // namespace mrf
} // namespace pcl
