// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What a reconstruction did: status, resolved parameters, counts, levels, times, the mesh.
#pragma once

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/hold_out.h>
#include <pcl/surface/mrf/mesh_quality.h>
#include <pcl/surface/mrf/multiscale.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/orientation.h>
#include <pcl/surface/mrf/sampling_density.h>
#include <pcl/surface/mrf/uncertainty.h>

#include <cstdint>
#include <string>
#include <vector>

namespace pcl {
namespace mrf {

/// Points by what became of them; `used` and all the drops add up to `input`.
struct PointCounts {
  std::int64_t input = 0; ///< in the cloud, after the indices
  std::int64_t notFinite = 0;
  std::int64_t duplicates = 0;     ///< same position as an earlier point
  std::int64_t zeroNormals = 0;    ///< with the cloud's normals in use: zero or not finite
  std::int64_t zeroConfidence = 0; ///< confidence field not finite or ≤ 0
  std::int64_t outliersAlone = 0;  ///< OutlierOptions::alone, and so on
  std::int64_t outliersBySpacing = 0;
  std::int64_t outliersByStatistics = 0;
  std::int64_t noiseByPlaneFit = 0; ///< the paper's PCA criteria, or no plane could be fitted
  std::int64_t smallComponents = 0;
  std::int64_t outliersByField = 0; ///< OutlierOptions::robust
  std::int64_t alone = 0;           ///< far from all others and too few for a surface, see pieces.h
  std::int64_t used = 0;
};

struct StageTime {
  std::string stage;
  double seconds = 0;
};

/// What was solved for a part of a cloud in pieces.
struct PieceReport {
  std::int64_t points = 0;
  std::vector<LevelReport> levels; ///< coarsest first
};

struct Report {
  Status status = Status::notRun;
  std::string message = "not run"; ///< "ok", or what went wrong and what to do about it
  std::vector<std::string> warnings;

  Options options; ///< as requested, with every automatic value replaced by the one that was used
  SamplingDensity density;
  double diagonal = 0;         ///< of the used points' bounding box, cloud's unit
  double smoothingLength = 0;  ///< ℓ, or what β implies at the finest level, cloud's unit; 0 if β is 0
  SmoothingChoice smoothing;   ///< how ℓ was chosen; empty if it was given, or is not used
  ResolutionChoice resolution; ///< how the voxel size was chosen; empty if it was given, by itself or by a quality

  PointCounts points;
  bool normalsEstimated = false;
  OrientationVote vote = OrientationVote::none;
  bool sensorOriginUsed = false; ///< the sensor that voted is the origin that the cloud names
  /// Nobody named a sensor, but all normals (one in a thousand may not) look at the origin of the coordinates, at most
  /// 100 diagonals of the cloud away: it counts as one where trimming asks what was hidden.
  bool sensorSupposed = false;
  OrientationSummary orientation;

  std::vector<LevelReport> levels;      ///< coarsest first; of a cloud in pieces those of the one with most points
  std::vector<PieceReport> otherPieces; ///< see pieces.h; mostly none
  TrimSummary trimming;
  RemeshSummary remesher; ///< without remeshing all 0
  /// Triangles that intersect others, of the zero level and of the mesh: by remeshing none are added. A closed zero
  /// level has none; where a cut runs through one vertex twice, trimming leaves some, which remeshing takes apart.
  std::int64_t intersectingBeforeRemeshing = 0, intersecting = 0;
  MeshStatistics meshBeforeRemeshing; ///< after trimming; what neither remeshing nor maxError changes is mesh
  MeshStatistics mesh;
  ErrorLimitSummary beyondError; ///< all 0 without UncertaintyOptions::maxError
  UncertaintyReport uncertainty; ///< empty unless it was asked for

  std::vector<StageTime> times;   ///< in the order they ran
  double seconds = 0;             ///< wall clock of the whole run
  std::size_t predictedBytes = 0; ///< what the levels were expected to take, see predictedMemory; of pieces the most
  std::size_t peakBytes = 0;      ///< peak resident memory of the process
  int threads = 1;
};

} // namespace mrf
} // namespace pcl
