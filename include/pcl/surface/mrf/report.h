// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The report of a reconstruction: status, options as used, counts, levels, times, statistics of the mesh.
#pragma once

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/lattice.h>
#include <pcl/surface/mrf/options.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace pcl::mrf {

/// The distances between the points, cloud's unit.
struct SamplingDensity {
  float spacing = 0;          ///< unit of automatic lengths, l̄, by Options::unit
  float nearestMean = 0;      ///< mean distance to the closest other point (the paper's l̄)
  float nearestDeviation = 0; ///< standard deviation of that distance, σ_l
  float eighthMedian = 0;     ///< median distance to the 8th neighbor; 0 with fewer than 9 distinct points
};

/// How the signs of the components were decided.
struct OrientationSummary {
  std::int64_t components = 0;          ///< after joining over creases, before dropping
  std::int64_t componentsAtCreases = 0; ///< by the angle criterion alone
  std::int64_t componentsDropped = 0;
  std::int64_t componentsFlipped = 0; ///< by the vote
  std::int64_t piecesFlipped = 0;     ///< pieces of smooth surface whose own vote turned them against their component
  std::int64_t pointsDropped = 0;
  std::int64_t pointsFlipped = 0; ///< normals whose sign was changed
  /// Share of the kept points' votes that agree with the normals; 1 without a vote. An outward vote counts by its
  /// contribution to the volume: 1 for a convex component, about ½ for one without inside and outside.
  double agreement = 1;
  double openShare = 0; ///< without sensor or reference: share of the surface in components without a volume, 0..1
  /// The surface is open, or may be seen from within, and nothing tells its outside: the chosen side is a guess.
  bool sideIsGuessed = false;
};

/// The score of one smoothing length.
struct SmoothingScore {
  double smoothing = 0; ///< ℓ, cloud's unit
  double error = 0;     ///< mean |distance| of the held-out points from its zero level, cloud's unit
};

struct SmoothingChoice {
  double smoothing = 0; ///< chosen ℓ, cloud's unit
  double noise = 0; ///< robust standard deviation of the held-out points at the chosen ℓ, cloud's unit: the noise σ, or
                    ///< on clean scans the detail that the grid cannot resolve
  std::vector<SmoothingScore> curve; ///< tried ℓ, ascending; empty if there were too few points
  std::int64_t heldOut = 0;          ///< points that were held out and scored
};

/// The score of one voxel size.
struct ResolutionScore {
  double voxelSize = 0; ///< h, cloud's unit
  double error = 0;     ///< mean |distance| of the held-out points from its zero level, cloud's unit
};

struct ResolutionChoice {
  double voxelSize = 0;               ///< chosen h, cloud's unit
  std::vector<ResolutionScore> curve; ///< tried h, finest first; empty if there were too few points
  std::int64_t heldOut = 0;           ///< held-out points that all sizes were scored at
  std::int64_t cubes = 0;             ///< cubes that were solved, counted once for each size: a measure of the work
};

/// What a solve did.
struct SolveReport {
  SolverMethod method = SolverMethod::multigrid;
  int iterations = 0;          ///< iterations or sweeps; 1 for cholesky
  double relativeResidual = 0; ///< ‖b − A d‖ / ‖b‖ at the end
  /// Multigrid: estimated change that further steps would make at observed voxels near the zero level, RMS in voxel
  /// sides. It follows from the last step and the fall of the residual.
  double remainingChange = 0;
  double remainingChangeOfFillings = 0; ///< the same for unobserved voxels near the zero level
  /// Whether the method met its tolerance; on levels in bands, whose number of steps is fixed: remainingChange ≤ .1.
  bool converged = false;
  /// Per iteration: relative residual (multigrid, cg) or energy per voxel (icm); empty for cholesky.
  std::vector<double> history;
};

/// One level of the multiscale scheme.
struct LevelReport {
  GridSize size;
  double voxelSize = 0;      ///< cloud's unit
  float maxDistance = 0;     ///< dEmax of this level, cloud's unit
  std::int64_t observed = 0; ///< voxels with α > 0
  std::int64_t unknowns = 0; ///< voxels that were solved for: all, or those of a band
  int tiles = 1;             ///< number of tiles, solved one after the other
  double observationSeconds = 0;
  double solverSeconds = 0;
  SolveReport solve;
};

struct TrimSummary {
  std::int64_t holesFilled = 0;           ///< unsupported parts that were kept, including bays of the rim
  std::int64_t extrapolationsDropped = 0; ///< unsupported parts that were dropped
  std::int64_t componentsDropped = 0;
  double areaFilled = 0, areaDropped = 0; ///< cloud's unit squared
  double largestHole = 0;                 ///< diameter of the largest part that was kept, cloud's unit
  double cappedShare = 0; ///< share of the closed surface's area that TrimmingOptions::watertight added, 0..1
};

/// The surface that UncertaintyOptions::maxError dropped; areas in the cloud's unit squared.
struct ErrorLimitSummary {
  std::int64_t triangles = 0;
  double area = 0;
  double measuredArea = 0; ///< part of the area that points support
};

struct RemeshSummary {
  std::int64_t splits = 0, collapses = 0, flips = 0;
  std::int64_t refusedOperations = 0; ///< would have flipped a triangle, broken the topology or left the surface
  double targetEdge = 0;              ///< target edge length that was used, cloud's unit
};

struct MeshStatistics {
  std::int64_t vertices = 0;
  std::int64_t triangles = 0;
  std::int64_t edges = 0;
  std::int64_t components = 0; ///< connected components; triangles are connected over edges
  std::int64_t boundaryEdges = 0;
  std::int64_t boundaryLoops = 0;
  std::int64_t nonManifoldEdges = 0;    ///< edges with more than two triangles, or with two of opposite orientation
  std::int64_t nonManifoldVertices = 0; ///< vertices whose triangles do not form one fan
  std::int64_t degenerateTriangles = 0; ///< with a repeated, missing or non-finite vertex, or a quality below 1e-6
  std::int64_t unusedVertices = 0;
  std::int64_t eulerCharacteristic = 0; ///< V − E + F, V without unused vertices
  double area = 0;                      ///< cloud's unit squared
  double volume = 0;      ///< signed, cloud's unit cubed, by the divergence theorem; meaningful for closed meshes
  double meanQuality = 0; ///< mean of triangleQuality over all triangles, 0..1
  double minQuality = 0;
  double meanEdge = 0, minEdge = 0, maxEdge = 0; ///< cloud's unit
  double areaDeviation = 0;                      ///< standard deviation of triangle area / mean area
  std::array<std::int64_t, 16> valences{}; ///< number of vertices by number of edges; the last bin collects ≥ 15

  bool closed() const { return boundaryEdges == 0; }
  bool manifold() const { return nonManifoldEdges == 0 && nonManifoldVertices == 0; }
  /// Share of vertices with six edges.
  double regularShare() const
  {
    return vertices > 0 ? static_cast<double>(valences[6]) / static_cast<double>(vertices) : 0;
  }
};

/// Half-width in sigmas of the interval that holds the surface in 95 of 100 cases.
constexpr double halfWidthPerSigma = 1.96;

/// Quantiles of the sigma of some vertices, cloud's unit.
struct SigmaQuantiles {
  std::int64_t vertices = 0;
  double median = 0, percentile95 = 0, max = 0;
};

/// Statistics of a quantity over the drawn surfaces; volumes are in the cloud's unit cubed.
struct SampledQuantity {
  double mean = 0, deviation = 0; ///< of the drawn surfaces
  double lower = 0,
         upper = 0; ///< interval of another surface, and so of the true one, in 95 of 100 cases (Student's t)
};

/// Measurements of surfaces drawn from the posterior with the deviation sigma. The vertices of a surface move together,
/// so that their errors cancel only as far as they are independent. Errors that sigma lacks are missing here too.
struct SampledShape {
  int surfaces = 0;       ///< number of drawn surfaces; 0: all else is zero
  bool isClosed = false;  ///< whether the mesh is closed; if not, volume is zero
  SampledQuantity volume; ///< volume inside the curved surface that vertices and normals define
  SampledQuantity area;   ///< area of the triangles: roughness below the size of triangles is not included
  std::array<SampledQuantity, 3> extent; ///< size of the bounding box along x, y and z, cloud's unit
};

/// How sigma was estimated, and how large it is.
struct UncertaintyReport {
  bool isComputed = false; ///< false: all else is zero
  int samples = 0;         ///< draws from the posterior
  double voxelSize = 0;    ///< voxel side of the grid of the draws, cloud's unit; the largest of all pieces
  std::int64_t voxels = 0; ///< voxels of the grids of the draws

  double noise = 0; ///< σ of the scanner's noise, cloud's unit: the error that neighboring held-out points do not share
  std::int64_t heldOut = 0; ///< points that were held out in pairs of neighbors; 0: none
  double measuredError = 0; ///< RMS error of the surface, cloud's unit: the error that pairs share, or a share of noise
                            ///< that neighbors share

  /// Mean signed distance of the surface from the points, along its normals, cloud's unit: trilinear voxels shift a
  /// curved surface to one side. This error is common to the whole surface and does not cancel in a volume.
  double offset = 0;

  std::int64_t patches = 0;     ///< discs of points that were left out to see how well such openings are filled
  std::int64_t patchPoints = 0; ///< points in these discs
  double largestPatch = 0;      ///< diameter of the largest one, cloud's unit
  double largestOpening = 0;    ///< diameter of the largest filling, as trimming measures it
  double fillingFactor =
      0; ///< standard deviation of the data that explains the errors of the filled discs, cloud's unit
  std::int64_t notCalibrated = 0; ///< vertices whose sigma is extrapolated

  SigmaQuantiles measured; ///< sigma of vertices with a confidence above 0
  SigmaQuantiles fillings; ///< sigma of the other vertices
  SampledShape shape;
};

/// Number of points by their fate; `used` and all the drops add up to `input`.
struct PointCounts {
  std::int64_t input = 0; ///< points of the cloud that the indices select
  std::int64_t notFinite = 0;
  std::int64_t duplicates = 0;     ///< at the position of an earlier one, or near copies of it
  std::int64_t zeroNormals = 0;    ///< with NormalSource::use: normal zero or not finite
  std::int64_t zeroConfidence = 0; ///< confidence field not finite or ≤ 0
  std::int64_t outliersAlone = 0;  ///< OutlierOptions::alone: far from their neighbors and on no surface
  std::int64_t outliersByStatistics = 0;
  std::int64_t mixedPixels = 0;     ///< OutlierOptions::alone: between two surfaces that their sensor saw
  std::int64_t ghosts = 0;          ///< OutlierOptions::alone: other sensors saw through them
  std::int64_t noiseByPlaneFit = 0; ///< by the paper's PCA criteria, or because no plane could be fitted
  std::int64_t smallComponents = 0;
  std::int64_t outliersByField = 0; ///< OutlierOptions::robust
  std::int64_t alone = 0;           ///< far from all others and too few for a surface, see src/run/pieces.h
  std::int64_t used = 0;
};

struct StageTime {
  std::string stage;
  double seconds = 0;
};

/// A part of a cloud in pieces that was solved on its own.
struct PieceReport {
  std::int64_t points = 0;
  std::vector<LevelReport> levels; ///< coarsest first
};

/// Noise of the points of similar range or spacing; lengths in the cloud's unit.
struct NoiseByKey {
  double key = 0;       ///< median range from the sensor, or median spacing
  double spacing = 0;   ///< median distance to the nearest point if the points were random
  double deviation = 0; ///< σ
  double white = 0;     ///< part of σ that neighbors do not share: residual of the 12 points closest along the surface
  double correlation = 0; ///< length c within which neighbors share the rest of σ
};

/// The noise of the points, as it is known or estimated from the cloud.
struct NoiseReport {
  bool isKnown = false;   ///< σ was given for each point, by a law, or for all; false: estimated from the cloud
  bool isByRange = false; ///< groups are by range from the only sensor; false: by local spacing
  std::vector<NoiseByKey> groups; ///< by ascending key; empty: ℓ was given, or there were too few points
  /// Neighbors share their errors, as in depth images: ℓ and the voxels follow σ, and points weigh by 1/σ². Other noise
  /// above .8 spacings: the same, but the voxels do not follow σ. Weaker noise is left to hold-out validation; if
  /// neighbors share it, points weigh by 1/σ² and the chosen ℓ is multiplied by `lengthening`.
  bool isCorrelated = false;
  /// Of the median point: key, σ (0 if it is unknown and left to hold-out validation) and, if neighbors share σ, ℓ;
  /// cloud's unit. Points weigh by 1/σ² with σ proportional to key^`exponent`; ℓ varies over the surface with σ^.4.
  double medianKey = 0, deviation = 0, smoothing = 0, exponent = 0;
  double lengthening = 1; ///< factor on ℓ, ≥ 1
};

struct Report {
  Status status = Status::notRun;
  std::string message = "not run"; ///< "ok", or the error and its remedy
  std::vector<std::string> warnings;

  Options options; ///< requested options, with automatic values as used, except those that each level or the machine
                   ///< decides
  SamplingDensity density;
  double diagonal = 0; ///< diagonal of the used points' bounding box, cloud's unit
  /// Smoothing length ℓ at points of weight 1, or what β implies at the finest level, cloud's unit; 0 if β is 0.
  double smoothingLength = 0;
  NoiseReport noise;         ///< noise of the points
  SmoothingChoice smoothing; ///< how ℓ was chosen; empty if it was given or is not used
  /// How the voxel size was chosen; empty if it was given, or by a quality other than normal.
  ResolutionChoice resolution;

  PointCounts points;
  bool normalsEstimated = false;  ///< the normals of all points were estimated
  std::int64_t normalsFilled = 0; ///< normals estimated for points whose own is missing
  /// Signs of the cloud's normals were found anew (not with NormalSource::use): more than a quarter opposed those of
  /// their neighbors, a tenth opposed most of their smooth piece, or they pointed into what the points enclose, and the
  /// cloud is no room.
  bool signsOpposed = false;
  OrientationVote vote = OrientationVote::none;
  bool sensorOriginUsed = false; ///< the sensor that voted is the cloud's own sensor origin
  /// No sensor is known, but all normals (except one in a thousand) look at the origin of the coordinates, at most 100
  /// diagonals of the cloud away. It then counts as the sensor for mixed pixels, noise by range, and trimming.
  bool sensorSupposed = false;
  OrientationSummary orientation;

  std::vector<LevelReport> levels;      ///< coarsest first; of the piece with most points
  std::vector<PieceReport> otherPieces; ///< the other pieces of the cloud, see src/run/pieces.h; usually none
  TrimSummary trimming;
  RemeshSummary remesher; ///< all 0 without remeshing
  /// Triangles that intersect others, before and after remeshing. Remeshing adds none. A closed zero level has none;
  /// trimming leaves some where a cut runs through a vertex twice, and remeshing removes those.
  std::int64_t intersectingBeforeRemeshing = 0, intersecting = 0;
  MeshStatistics meshBeforeRemeshing; ///< after trimming; the same as `mesh` without remeshing and maxError
  MeshStatistics mesh;
  ErrorLimitSummary beyondError; ///< all 0 without UncertaintyOptions::maxError
  UncertaintyReport uncertainty; ///< empty unless sigma was computed

  std::vector<StageTime> times;   ///< in the order they ran
  double seconds = 0;             ///< wall clock of the whole run
  std::size_t predictedBytes = 0; ///< predicted peak bytes of the levels; the largest of all pieces
  std::size_t peakBytes = 0;      ///< peak resident memory of the process
  int threads = 1;
};

} // namespace pcl::mrf
