// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What a reconstruction did: status, resolved parameters, counts, levels, times, the mesh.
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

/// Lengths in the cloud's unit.
struct SamplingDensity {
  float spacing = 0;          ///< the unit, as chosen; what the other stages call l̄
  float nearestMean = 0;      ///< mean distance to the closest other point (the paper's l̄)
  float nearestDeviation = 0; ///< standard deviation of that distance, σ_l
  float eighthMedian = 0;     ///< median distance to the 8th neighbor; 0 with fewer than 9 distinct points
};

/// How the signs of the components were decided.
struct OrientationSummary {
  std::int64_t components = 0;          ///< after joining, before dropping
  std::int64_t componentsAtCreases = 0; ///< as the angle criterion alone cuts them
  std::int64_t componentsDropped = 0;
  std::int64_t componentsFlipped = 0; ///< by the vote of sensors, reference normals or signed volume
  std::int64_t piecesFlipped = 0;     ///< pieces of smooth surface that their own vote turned against their component
  std::int64_t pointsDropped = 0;
  std::int64_t pointsFlipped = 0; ///< normals whose sign differs from the one they came with
  /// Share of the kept points' votes that agree with the normals, 1 without a vote. An outward vote counts by its
  /// contribution to the volume: 1 for a convex component, about ½ for one without inside and outside.
  double agreement = 1;
  double openShare = 0; ///< without sensor or reference: share of the surface in components that enclose no volume
  /// The surface is open, and nothing tells which side of it is the outside: the side that was taken is a guess.
  bool sideIsGuessed = false;
};

/// What points that a field has not seen say about it.
struct SmoothingScore {
  double smoothing = 0; ///< ℓ, cloud's unit
  double error = 0;     ///< mean |distance| of the held-out points from its zero level, cloud's unit
};

struct SmoothingChoice {
  double smoothing = 0; ///< ℓ that was chosen, cloud's unit
  double noise = 0;     ///< robust deviation of the held-out points at that ℓ, cloud's unit: the noise σ, or on
                        ///< clean scans what the grid does not resolve
  std::vector<SmoothingScore> curve; ///< what was tried, ascending; empty if there were too few points to tell
  std::int64_t heldOut = 0;          ///< points that were scored
};

/// What points that a field has not seen say about a voxel size.
struct ResolutionScore {
  double voxelSize = 0; ///< h, cloud's unit
  double error = 0;     ///< mean |distance| of the held-out points from its zero level, cloud's unit
};

struct ResolutionChoice {
  double voxelSize = 0;               ///< h that was chosen, cloud's unit
  std::vector<ResolutionScore> curve; ///< what was tried, finest first; empty if there were too few points to tell
  std::int64_t heldOut = 0;           ///< points that all sizes of the curve were scored at
  std::int64_t cubes = 0;             ///< that were asked, counted once for each size: the work
};

/// What a solve did.
struct SolveReport {
  SolverMethod method = SolverMethod::multigrid;
  int iterations = 0;          ///< iterations or sweeps; 1 for cholesky
  double relativeResidual = 0; ///< ‖b − A d‖ / ‖b‖ at the end
  /// Multigrid: what more steps would still change at observed voxels near the zero level, RMS in voxel sides, as the
  /// last step and the fall of the residual foretell.
  double remainingChange = 0;
  double remainingChangeOfFillings = 0; ///< the same of voxels near the zero level where nothing is observed
  /// The tolerance of the method is met; on levels in bands, which take a fixed number of steps: remainingChange ≤ .1.
  bool converged = false;
  std::vector<double>
      history; ///< per iteration: relative residual (multigrid, cg), energy per voxel (icm); empty for cholesky
};

/// One level, for the report.
struct LevelReport {
  GridSize size;
  double voxelSize = 0;      ///< cloud's unit
  float maxDistance = 0;     ///< dEmax of this level
  std::int64_t observed = 0; ///< voxels with α > 0
  std::int64_t unknowns = 0; ///< voxels that were solved for: all of them, or those of a band
  int tiles = 1;             ///< in which they were, one after the other
  double observationSeconds = 0;
  double solverSeconds = 0;
  SolveReport solve;
};

struct TrimSummary {
  std::int64_t holesFilled = 0;           ///< unsupported pieces that were kept, bays of the rim among them
  std::int64_t extrapolationsDropped = 0; ///< unsupported pieces that were dropped
  std::int64_t componentsDropped = 0;
  double areaFilled = 0, areaDropped = 0; ///< cloud's unit squared
  double largestHole = 0;                 ///< diameter of the largest piece that was kept, cloud's unit
  double cappedShare = 0;                 ///< of the area of the closed surface: what TrimmingOptions::watertight added
};

/// What UncertaintyOptions::maxError dropped; areas in the cloud's unit squared.
struct ErrorLimitSummary {
  std::int64_t triangles = 0;
  double area = 0;
  double measuredArea = 0; ///< of it, that of triangles with support
};

struct RemeshSummary {
  std::int64_t splits = 0, collapses = 0, flips = 0;
  std::int64_t refusedOperations = 0; ///< that would have flipped a triangle, broken the topology or left the surface
  double targetEdge = 0;              ///< that was used
};

struct MeshStatistics {
  std::int64_t vertices = 0;
  std::int64_t triangles = 0;
  std::int64_t edges = 0;
  std::int64_t components = 0; ///< connected over edges
  std::int64_t boundaryEdges = 0;
  std::int64_t boundaryLoops = 0;
  std::int64_t nonManifoldEdges = 0;    ///< more than two triangles, or two that disagree on the orientation
  std::int64_t nonManifoldVertices = 0; ///< triangles around the vertex do not form one fan
  std::int64_t degenerateTriangles = 0; ///< repeated or missing vertex, not finite, or quality below 1e-6
  std::int64_t unusedVertices = 0;
  std::int64_t eulerCharacteristic = 0; ///< V − E + F, V without unused vertices
  double area = 0;                      ///< cloud's unit squared
  double volume = 0;                    ///< signed, by the divergence theorem; meaningful for closed meshes
  double meanQuality = 0;               ///< of triangleQuality over all triangles
  double minQuality = 0;
  double meanEdge = 0, minEdge = 0, maxEdge = 0; ///< cloud's unit
  double areaDeviation = 0;                      ///< standard deviation of triangle area / mean area
  std::array<std::int64_t, 16> valences{};       ///< vertices by number of edges; the last bin collects ≥ 15

  bool closed() const { return boundaryEdges == 0; }
  bool manifold() const { return nonManifoldEdges == 0 && nonManifoldVertices == 0; }
  /// Share of vertices with six edges.
  double regularShare() const
  {
    return vertices > 0 ? static_cast<double>(valences[6]) / static_cast<double>(vertices) : 0;
  }
};

/// Of the interval that holds the surface in 95 of 100 cases, to each side of a vertex.
constexpr double halfWidthPerSigma = 1.96;

/// Of the sigma of some vertices, cloud's unit.
struct SigmaQuantiles {
  std::int64_t vertices = 0;
  double median = 0, percentile95 = 0, max = 0;
};

/// A number that belongs to a surface, over surfaces that sigma allows for; volumes are in the cloud's unit cubed.
struct SampledQuantity {
  double mean = 0, deviation = 0; ///< of the drawn surfaces
  double lower = 0, upper = 0;    ///< hold another one's, and so the true one's, in 95 of 100 cases: Student's t
};

/// What surfaces drawn from the posterior measure, moved as sigma says: the vertices of one move together, so that
/// errors cancel as far as they would. What sigma does not know of, these do not, either.
struct SampledShape {
  int surfaces = 0;       ///< 0: all else is zero
  bool isClosed = false;  ///< false: there is no volume
  SampledQuantity volume; ///< enclosed, as the curved surface through the vertices and their normals has it
  SampledQuantity area;   ///< of the triangles: what is rough on a smaller scale than they are is not in it
  std::array<SampledQuantity, 3> extent; ///< of the bounding box along x, y and z
};

/// What sigma was learnt from, and how large it is.
struct UncertaintyReport {
  bool isComputed = false; ///< all else is zero if it is not
  int samples = 0;         ///< draws from the posterior
  double voxelSize = 0;    ///< of the grid that they were drawn on, cloud's unit; of pieces the coarsest
  std::int64_t voxels = 0; ///< of that grid

  double noise = 0;         ///< of the scanner: what neighboring points that were left out do not share, cloud's unit
  std::int64_t heldOut = 0; ///< points that were left out amid others, by pairs; 0: none could be
  double measuredError = 0; ///< what such pairs share, or a share of noise that is shared: the surface's own error, RMS

  /// Mean distance of the surface from the points, along its normals, cloud's unit: trilinear voxels push a curved
  /// surface to one side. Errors that all of the surface shares do not cancel in a volume.
  double offset = 0;

  std::int64_t patches = 0;       ///< discs of points that were left out to be filled
  std::int64_t patchPoints = 0;   ///< in them
  double largestPatch = 0;        ///< diameter of the largest one, cloud's unit
  double largestOpening = 0;      ///< diameter of the largest filling, as trimming measures it
  double fillingFactor = 0;       ///< standard deviation of the data that the fillings' errors speak for, cloud's unit
  std::int64_t notCalibrated = 0; ///< vertices whose sigma is an extrapolation

  SigmaQuantiles measured; ///< of vertices with a confidence above 0
  SigmaQuantiles fillings; ///< of the others
  SampledShape shape;
};

/// Points by what became of them; `used` and all the drops add up to `input`.
struct PointCounts {
  std::int64_t input = 0; ///< in the cloud, after the indices
  std::int64_t notFinite = 0;
  std::int64_t duplicates = 0;     ///< same position as an earlier point
  std::int64_t zeroNormals = 0;    ///< with NormalSource::use: zero or not finite
  std::int64_t zeroConfidence = 0; ///< confidence field not finite or ≤ 0
  std::int64_t outliersAlone = 0;  ///< OutlierOptions::alone, and so on
  std::int64_t outliersByStatistics = 0;
  std::int64_t mixedPixels = 0;     ///< OutlierOptions::alone: between two surfaces that their sensor saw
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

/// Noise of points of about one range or spacing, lengths in the cloud's unit.
struct NoiseByKey {
  double key = 0;         ///< median range from the sensor, or spacing
  double spacing = 0;     ///< median distance to the nearest point, as if the points were random
  double deviation = 0;   ///< σ
  double white = 0;       ///< the part of it that neighbors do not share: what the 12 closest along the surface show
  double correlation = 0; ///< length c within which they share the rest
};

/// What is known of the noise, or the cloud tells about it.
struct NoiseReport {
  bool isKnown = false;   ///< σ was given: of each point, by a law, or of all; else it is as the cloud shows it
  bool isByRange = false; ///< the groups: from the only sensor; else by local spacing
  std::vector<NoiseByKey> groups; ///< by ascending key; empty: ℓ was given, or too few points to tell
  /// Neighbors share their errors, as in depth images: ℓ and the voxels follow σ, and points weigh by 1/σ². Of other
  /// noise points weigh by 1/σ² and ℓ follows σ if that is above .8 spacings; less is left to points that are held out,
  /// but for what they do not tell as neighbors share it: points weigh by 1/σ², and their ℓ is multiplied.
  bool isCorrelated = false;
  /// Of the median point: its key, its σ, unless points held out tell, and its ℓ, if neighbors share σ, cloud's
  /// unit; and the exponent of the key in what points weigh by, with which^.4 ℓ goes elsewhere.
  double medianKey = 0, deviation = 0, smoothing = 0, exponent = 0;
  double lengthening = 1; ///< by what; 1: not so
};

struct Report {
  Status status = Status::notRun;
  std::string message = "not run"; ///< "ok", or what went wrong and what to do about it
  std::vector<std::string> warnings;

  Options options; ///< as requested; automatic values are those that were used, but for what each level or the machine
                   ///< decides
  SamplingDensity density;
  double diagonal = 0; ///< of the used points' bounding box, cloud's unit
  double smoothingLength =
      0;             ///< ℓ at points of weight 1, or what β implies at the finest level, cloud's unit; 0 if β is 0
  NoiseReport noise; ///< of the points; what ℓ follows if they share their errors
  SmoothingChoice smoothing;   ///< how ℓ was chosen; empty if it was given, or is not used
  ResolutionChoice resolution; ///< how the voxel size was chosen; empty if it was given, by itself or by a quality

  PointCounts points;
  bool normalsEstimated = false;  ///< of all points
  std::int64_t normalsFilled = 0; ///< estimated of points without one, beside the cloud's
  /// More than a quarter of the cloud's normals pointed to the other side than their neighbors', or into what the
  /// points enclose, as if this were no room: the axes were kept and the signs found anew, unless NormalSource::use
  /// keeps them.
  bool signsOpposed = false;
  OrientationVote vote = OrientationVote::none;
  bool sensorOriginUsed = false; ///< the sensor that voted is the origin that the cloud names
  /// Nobody named a sensor, but all normals (one in a thousand may not) look at the origin of the coordinates, at most
  /// 100 diagonals of the cloud away: it counts as one where trimming asks what it saw through.
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

} // namespace pcl::mrf
