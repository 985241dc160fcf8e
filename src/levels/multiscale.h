// SPDX-License-Identifier: BSD-3-Clause
/// The multiscale scheme (paper Sec. 3.4): solve coarse, interpolate, observe again, solve finer.
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace pcl::mrf {

/// Voxel side h in spacings l̄.
inline float spacingsPerVoxel(Quality quality)
{
  return quality == Quality::draft ? 3 : quality == Quality::normal ? 2 : 1.5f;
}

/// Levels are added until the longest side of the coarsest one has at most this many voxels.
constexpr int coarsestSide = 16;

/// Voxels of padding that a closed surface needs.
constexpr int minPadding = 6;

/// The option, or minPadding where it is automatic.
int resolvedPadding(const MultiscaleOptions& options);

/// The option, or what suits the number of points. Objects have some 50 voxels per point. Sprawling scenes with few
/// points have hundreds, most of them empty, which bands leave out: a Kinect frame of a table, thinned to 1,000 and
/// 4,000 points, takes a half and a third of the time in bands, and withheld points are as near.
std::int64_t resolvedDenseVoxels(const MultiscaleOptions& options, std::size_t points);

struct MultiscaleResult {
  DistanceField field;
  std::vector<LevelReport> levels; ///< coarsest first
  std::size_t predictedBytes = 0;  ///< peak bytes of the levels, as predicted
};

/// The order of axes in which levels in bands of this size are stored: the natural one, or the longest axis as z and
/// the shortest as y if that makes planes or the table of rows smaller by a third. Bands need memory for a few whole
/// planes of voxels across z at a time, and for one table entry per row along x.
AxisOrder bandAxes(const GridSize& size);

/// What the memory of a run depends on besides the box and the voxel size.
struct Workload {
  double area = 0;   ///< of the surface, cloud's unit²
  double points = 0; ///< that are observed
  double reach = 0;  ///< dEmax where voxels are observed, cloud's unit; 0: observed at the points
  PriorOptions prior;
  SolverOptions solver;
  bool isTiled = false; ///< solve the finest level in tiles, if it may be: that takes less memory
};

/// The nested lattices of the levels, coarsest first. Voxel sides double from level to level and voxel faces coincide.
/// \param box that they cover, with the padding around it
/// \throw ResourceLimit if a single thread would take more memory than the limit, or a factorization more time than its
/// own limit; the message names the voxel size that would fit
std::vector<Lattice> planLevels(const BoundingBox& box, float voxelSize, const Workload& workload,
                                const MultiscaleOptions& options);

/// How many threads, 1 to `threads`, can sweep over a level in a band within the memory limit: each takes memory for
/// some whole planes. Parameters as for planLevels.
int affordableThreads(const BoundingBox& box, float voxelSize, const Workload& workload,
                      const MultiscaleOptions& options, int threads);

/// A part of the points that has a field of its own.
struct SolvedPiece {
  const OrientedPoints* points;
  const NeighborSearch* search; ///< holds their positions
  BoundingBox volume;           ///< that its field covers, with the padding around it; contains the points
};

/// The levels of a run, coarse to fine: each starts from the interpolation of the coarser one, the coarsest from 0.
class Levels {
public:
  virtual ~Levels() = default;

  virtual bool done() const = 0;

  /// Voxel side of the last level that was solved, cloud's unit. \pre solveNext() was called
  virtual float voxelSize() const = 0;

  /// \throw SolverFailure; Cancelled; ResourceLimit if the surface would take more memory than the limit, or millions
  /// of voxels, thousands for each point
  virtual void solveNext() = 0;

  /// True if the next level takes so much memory that a search should be put to rest while it is solved.
  virtual bool needsRoom() const = 0;

  /// True if refineOnly() saves more time than it takes, before the next level is solved.
  virtual bool mayLeaveOut() const = 0;
  /// The zero level of the last level, which predicts those of the finer ones. \pre mayLeaveOut()
  virtual TriangleMesh zeroLevel() = 0;
  /// Restricts the finer levels to what is observed or near `wanted`. \param wanted part of zeroLevel()
  virtual void refineOnly(const TriangleMesh& wanted) = 0;

  /// \pre done(); called once \throw InvalidInput if nothing is observed
  virtual MultiscaleResult result() = 0;
};

/// Plans the levels. \param piece its points and search outlive the levels \param spacing l̄, cloud's unit
/// \param tiles of the finest level, if it may be tiled; 0: as few as the limit of the memory allows
/// \throw InvalidOption
/// \throw ResourceLimit if the levels would take more memory than the limit, as predicted from the box
std::unique_ptr<Levels> beginLevels(const SolvedPiece& piece, float spacing, const Options& options,
                                    Execution& execution, int tiles = 0);

/// Regularizes the observed distances: solves all levels, with nothing left out.
MultiscaleResult regularize(const SolvedPiece& piece, float spacing, const Options& options, Execution& execution,
                            int tiles = 0);

} // namespace pcl::mrf
