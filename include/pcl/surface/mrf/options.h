// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief All options of a reconstruction, one struct per stage, and the presets.
#pragma once

#include <pcl/surface/mrf/export.h>

#include <cstddef>
#include <cstdint>
#include <string>

namespace pcl::mrf {

/// The unit that automatic lengths are multiples of.
enum class LengthUnit {
  density, ///< .5/√ρ with ρ points per area; the same for random and for evenly spread points of one density
  nearest  ///< the mean distance to the closest other point (the paper's l̄); longer for evenly spread points
};

/// The data structure that finds nearest points.
enum class SearchKind {
  bins,  ///< the library's own, see makePointBins
  kdTree ///< PCL's, see makeKdTree
};

/// Independent criteria: a point is dropped if any rejects it. The report warns of a criterion that drops over 2 %.
struct OutlierOptions {
  /// Drop points that are far from their neighbors for the local or the cloud's spacing and on no surface with
  /// them; also points between two surfaces that their sensor saw (mixed pixels), and those that other sensors saw
  /// through (ghosts of what moved).
  bool alone = true;
  bool statistical = false; ///< PCL's StatisticalOutlierRemoval: 8 neighbors, 3 standard deviations
  bool robust = false;      ///< drop points that disagree with a robust field, after the points are oriented
};

/// How the normals that come with the cloud are used.
enum class NormalSource {
  automatic, ///< use the cloud's normals, with new signs if they cannot be right; estimate missing ones, and all if
             ///< strong noise scatters them
  use,       ///< use the cloud's normals as they are
  reference, ///< estimate all normals; the cloud's normals vote on the orientation of each component
  estimate   ///< estimate all normals; ignore the cloud's
};

struct NormalOptions {
  NormalSource source = NormalSource::automatic;
  /// Neighborhood radius, cloud's unit; 0 = by the local spacing, or 2.5 l̄ as in the paper with noiseCriteria.
  float radius = 0;
  bool noiseCriteria = false; ///< drop noise as the paper does: points farther than l̄ from the fitted plane, or whose
                              ///< smallest eigenvalue explains more than 10 % of the variation
};

struct OrientationOptions {
  float maxAngle = 15; ///< neighbors belong together if their normals differ by at most this angle, degrees, (0, 90]
  /// Whether the cloud's own sensor origin counts as the sensor if none is given; it must not be zero, unless the cloud
  /// is organized. If all normals look at the origin of the coordinates, that counts as a sensor too, but does not
  /// vote: see Report::sensorSupposed.
  bool sensorOrigin = true;

  /// \name What components are; no options of tools
  /// @{
  float neighborDistance = 0; ///< two points closer than this are neighbors, cloud's unit; 0 = by localDistance
  bool localDistance = true;  ///< true: the automatic distance is five local spacings of each of the two points; false:
                              ///< the paper's, max(l̄ + 6 σ_l, 2.5 l̄) for all
  bool joinAcrossCreases = true; ///< also join components over edges that exceed the angle, most parallel first
  float minComponentShare = 0;   ///< drop components with less than this share of the points, [0, 1); the paper: .01
  /// @}
};

/// What decides the sign of a component's normals.
enum class OrientationVote {
  none,      ///< keep the normals' signs; only the components are computed
  reference, ///< the majority of dot(normal, reference normal)
  sensor,    ///< the majority of dot(normal, sensor - position); the nearest sensor counts where a view is unknown
  outward ///< positive signed volume Σ A (p - centroid)·n > 0, A the area that a point stands for; for components that
          ///< enclose a volume, see OrientationSummary
};

/// How the points become observations of the field. All kinds but `points` observe one signed distance per voxel near
/// the points, from the distances δ_j = n_j·(x − p_j) to the tangent planes of its nearest points.
enum class ObservationKind {
  points,   ///< value and gradient at the points themselves, nothing at voxels; see point_observation.h
  median,   ///< L1: robust to outliers (the paper's choice)
  mean,     ///< L2: for Gaussian noise
  nearest,  ///< the plane of the nearest point alone
  plane,    ///< G: Σ g_j δ_j / Σ g_j, g_j = exp(−t_j²/2s²), t_j the tangential distance to p_j, s = 0.75 l̄
  trapezoid ///< T: the same with δ_j = ½ (n_j + n̄)·(x − p_j), n̄ = unit(Σ g_j n_j); corrects for curvature
};

/// How the confidence α falls with t = d_E / dEmax; d_E is the distance to the nearest point.
enum class ConfidenceShape {
  linear,   ///< α = 1 − min(t, 1) (the paper's)
  quadratic ///< α = 1 − min(t, 1)²
};

struct ObservationOptions {
  ObservationKind kind = ObservationKind::points;

  // Used if the field is observed at the points.
  float smoothing = 0; ///< smoothing length ℓ, cloud's unit: smaller details are smoothed away; 0 = by the noise if it
                       ///< is known, else chosen by hold-out validation
  float noise = 0; ///< standard deviation of the scanner's noise, cloud's unit; 0 = unknown
  /// Law of the noise, by name and numbers; z is a point's range from its sensor, cloud's unit. Points weigh by 1/σ²
  /// where σ varies, and the smoothing length follows the median σ. automatic: estimated from the cloud; none: left to
  /// hold-out validation; constant:S: the same as `noise`; quadratic:A,B: σ = A + B z²; tof:A,B (time of flight): σ = A
  /// + B z; kinect:D,F: σ = D z²/F, D the disparity's error in pixels, F focal length times baseline, pixels · cloud's
  /// unit (kinect alone: .088, 43.5 m).
  std::string noiseModel = "automatic";
  float gradientWeight = 0; ///< g²/ℓ², weight of the normals beside the positions, 0..100; 0 = .4 or 4 as hold-out
                            ///< validation finds if it also chooses ℓ and the cloud has normals, else .4

  // Used if the field is observed at voxels.
  int neighbors = 5; ///< nearest points per voxel, 1..100

  // Used for the confidence of voxels, and of the surface in colors and trimming.
  float maxDistance = 0; ///< dEmax, cloud's unit; 0 = 3 l̄ (the paper's), or 3.25 l̄ for points, plane and trapezoid
  ConfidenceShape confidenceShape = ConfidenceShape::quadratic; ///< no option of tools

  bool atPoints() const { return kind == ObservationKind::points; }
};

/// Order k of the prior; the operator of the linear system is L^k, L the graph Laplacian.
enum class Prior {
  membrane = 1,   ///< differences of neighbors (paper Eq. 5, 9, 13)
  thinPlate = 2,  ///< the fixed point of the paper's ICM for its Laplacian prior (Eq. 6)
  triharmonic = 3 ///< the exact minimizer of the sum of Eq. 6 over all voxels
};

/// The energy that is minimized, with a = αβ and w = a/(1−a); see src/method.md. A β of .9 with `paper` smooths as one
/// of .82 (k = 1) or .33 with `joint`.
enum class Energy {
  joint, ///< as the paper's program does it, Eq. 9 / 13: L^k d + c_k W (d − d°) = 0
  /// As the paper's text says, Eq. 10–11: the minimum of Σ (1−a_i) U(d_i) + a_i (d_i − d°_i)². For observations at
  /// voxels. Conjugate gradients replace multigrid.
  paper
};

struct PriorOptions {
  Prior kind = Prior::triharmonic;
  float beta = .99f; ///< global weight β of data observed at voxels, [0, 1); a larger β trusts the data more
  Energy energy = Energy::joint;
};

enum class SolverMethod {
  multigrid, ///< conjugate gradients, preconditioned by one multigrid V-cycle; see grid_solver.h
  icm,       ///< the paper's iterated conditional modes, voxel by voxel in a random order; see solveIcm
  cg,        ///< Fletcher–Reeves conjugate gradients on the energy
  cholesky, ///< sparse Cholesky factorization by CHOLMOD; needs the module libpcl_mrf_cholesky; refused above some 16 s
  icmColors ///< iterated conditional modes in parallel, by classes of voxels that do not interact
};

/// True for the methods that visit voxel after voxel.
inline bool isIcm(SolverMethod method)
{
  return method == SolverMethod::icm || method == SolverMethod::icmColors;
}

struct SolverOptions {
  SolverMethod method = SolverMethod::multigrid;
  /// Iterations or sweeps per level at most, ≥ 0; 0 = 100 (multigrid; 4, 2, 1 in bands), 1000 (icm), 10000 (cg).
  int maxIterations = 0;
  /// icm and multigrid stop when a step changes d by less than this, RMS in voxel sides; 0 = never. If points are
  /// observed, multigrid on whole levels stops at 1.5 times this.
  double changeTolerance = 5e-4;
  std::uint64_t seed = 1; ///< seed of icm's visiting order and of the draws of UncertaintyOptions

  /// \name Of the solvers' inside; no options of tools
  /// @{
  double residualTolerance = 1e-6; ///< multigrid and cg stop at ‖b − A d‖ ≤ this · ‖b‖; (0, 1)
  int smootherDegree = 0; ///< Chebyshev degree of the smoother before and after the coarse correction, 0..50; 0 = 2 / 5
                          ///< / 4 for k = 1 / 2 / 3, on levels in bands 2 / 4 / 5
  bool choleskyOnCoarsest = false; ///< factorize the coarsest level whatever the method
  /// @}
};

/// Voxel side h of the finest level. Each finer setting costs about 2.5 times the time and memory.
enum class Quality {
  draft,  ///< h = 3 l̄
  normal, ///< h = 2 l̄, or coarser if hold-out validation finds that enough, see HoldOut
  fine    ///< h = 1.5 l̄
};

/// How the start of a level is interpolated from the next coarser one.
enum class Interpolation {
  cubic, ///< keeps the curvature of the coarser level, so that less is left to solve
  linear ///< the paper's
};

struct MultiscaleOptions {
  Quality quality = Quality::normal;
  float voxelSize = 0; ///< voxel side h of the finest level, cloud's unit; 0 = by the quality
  int padding = 0; ///< voxels of the finest level around the points' bounding box, 2..100; 0 = 6, around a box that is
                   ///< extended at openings, see volume.h
  std::size_t maxMemory = 0; ///< maximum bytes of the run, from its points to its mesh; 0 = 80 % of the free memory
  /// Levels with more voxels than this are solved only in a band around the zero level that the coarser level predicts,
  /// others everywhere; ≥ 0; 0 = 350 per point, but at least 2^18 and at most 2^20. Solvers other than multigrid, and
  /// Energy::paper, always solve everywhere.
  std::int64_t denseVoxels = 0;
  /// Between levels that are solved everywhere; bands use the cubic one. No option of tools.
  Interpolation interpolation = Interpolation::cubic;
};

enum class Trimming {
  none,     ///< keep everything; the surface is watertight inside the volume
  holes,    ///< keep fillings of holes up to a size; drop extrapolation and components without support
  supported ///< keep only surface that data support
};

struct TrimmingOptions {
  Trimming kind = Trimming::holes;
  float maxHole = 0; ///< largest diameter of a hole that is filled, cloud's unit; 0 = half the diagonal, see trim
  /// Largest width of a gap that is filled in an open surface, cloud's unit: of bays and holes, also of holes joined to
  /// the outside. 0 = maxHole if that is given, else 24 % of the diagonal, but 28 local spacings behind a step in depth
  /// and where a sensor would see the filling edge-on, and none where a sensor saw through.
  float maxGap = 0;
  /// Components that fewer coherent points support are dropped, but never the largest, 0..1000000; 0 or 1: none is
  /// dropped. Three suffice where no other surface is as close as they are to each other. Not with Trimming::none.
  int minComponentPoints = 12;
  /// Whether openings of any width are closed after trimming, as flat as they allow: plane openings by their plane. An
  /// open sheet gets a back side. Cannot be combined with UncertaintyOptions::maxError.
  bool watertight = false;
};

struct RemesherOptions {
  int rounds = 6; ///< rounds of remeshing, 0..1000; 0 = do not remesh
  /// Target edge length, cloud's unit. 0 = the median edge of the input mesh, as if all voxels had the finest size, and
  /// longer where points are sparse, see EdgeSizing.
  float targetEdge = 0;
  /// Number of triangles to end with, 0..1e8; 0 = as the edge length gives. The remesher makes at least as many, then
  /// collapses edges where the surface moves least, relative to the points' noise if that varies and is known.
  std::int64_t triangles = 0;
  bool fit = true; ///< true: triangles lie on the surface in the mean; false: vertices do, as in the paper

  /// True if the mesh is remeshed with triangles, not vertices, on the surface in the mean.
  bool fitsTriangles() const { return fit && runs(); }

  bool runs() const { return rounds > 0 || triangles > 0; }
};

/// Sigma of a vertex: the surface is within ± sigma along the vertex's normal in 68 of 100 cases, and within twice that
/// in 95. It does not include registration errors and normals that point to the wrong side.
struct UncertaintyOptions {
  bool compute = false; ///< compute sigma per vertex and Report::uncertainty; needs observations at points
  int samples = 8;      ///< draws from the posterior, 2..1000; SolverOptions::seed is their seed
  /// Number of plausible surfaces in the result, drawn as sigma allows, 0..1000; above 0, sigma is computed. They may
  /// intersect themselves where sigma is larger than the object is thin.
  int surfaces = 0;
  /// Surface whose 95 % half-width exceeds this is dropped, in addition to trimming, cloud's unit; so are parts that
  /// hang on by single triangles. 0 = none. Above 0, sigma is computed.
  float maxError = 0;
};

/// Which colors the output carries.
enum class ColorMode {
  none,       ///< none
  input,      ///< the input's RGB or intensity if it has them, interpolated
  confidence, ///< the confidence α: blue where interpolated, skin where observed (paper Fig. 4)
  sigma       ///< sigma, which is then computed: blue where it is smallest, red where it is largest
};

/// All options. Lengths are in the cloud's unit; 0 means "derived from the sampling density" where the member says so.
struct Options {
  LengthUnit unit = LengthUnit::density; ///< unit of the automatic lengths
  SearchKind search = SearchKind::bins;  ///< used if no search object is given
  OutlierOptions outliers;
  NormalOptions normals;
  OrientationOptions orientation;
  ObservationOptions observation;
  PriorOptions prior;
  SolverOptions solver;
  MultiscaleOptions multiscale;
  TrimmingOptions trimming;
  RemesherOptions remesher;
  UncertaintyOptions uncertainty;
  ColorMode colors = ColorMode::input;
  std::string confidenceField; ///< name of the cloud's field with each point's confidence, 0..1; empty: none
  std::string noiseField;      ///< name of the field with each point's σ of the noise, cloud's unit, > 0; empty: none
  int threads = 0;             ///< number of threads, 0..1024; 0 = one per hardware thread
};

/// True if sigma is computed: for itself, for the colors, for plausible surfaces or for maxError.
inline bool wantsUncertainty(const Options& options)
{
  return options.uncertainty.compute || options.colors == ColorMode::sigma || options.uncertainty.surfaces > 0 ||
         options.uncertainty.maxError > 0;
}

/// The recommended settings; the same as Options().
PCL_MRF_EXPORT Options defaultPreset();

/// The paper's own settings. src/method.md lists them and the remaining differences. PCL's classes are used where the
/// paper's steps match theirs. Needs the module libpcl_mrf_cholesky.
PCL_MRF_EXPORT Options paperPreset();

/// The presets by name.
enum class Preset {
  standard, ///< defaultPreset
  paper     ///< paperPreset
};

PCL_MRF_EXPORT Options presetOptions(Preset preset);

/// Validates the options of all stages.
/// \throw InvalidOption naming the first value that is out of range, its range and the remedy
PCL_MRF_EXPORT void validate(const Options& options);

} // namespace pcl::mrf
