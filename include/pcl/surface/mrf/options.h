// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief All options of a reconstruction, one struct per stage, and the presets.
#pragma once

#include <pcl/surface/mrf/export.h>

#include <cstddef>
#include <cstdint>
#include <string>

namespace pcl::mrf {

/// What automatic lengths are multiples of.
enum class LengthUnit {
  density, ///< .5/√ρ with ρ points per area: the same for random and for evenly spread points of one density
  nearest  ///< the mean distance to the closest other point (the paper's l̄), twice as long on evenly spread points
};

/// What finds the nearest points of a run.
enum class SearchKind {
  bins,  ///< ours, see makePointBins
  kdTree ///< PCL's, see makeKdTree
};

/// Criteria are independent; a point is dropped if any enabled one rejects it. A share above 2 % is a warning of the
/// report, with the rule's name.
struct OutlierOptions {
  bool alone = true;        ///< no coherent neighbors, and far from them beside their own or the cloud's spacing; or
                            ///< between two surfaces that their sensor saw
  bool statistical = false; ///< PCL's StatisticalOutlierRemoval: 8 neighbors, 3 standard deviations
  bool robust = false;      ///< by a robust field, once the points are oriented
};

/// What becomes of normals that come with the cloud.
enum class NormalSource {
  automatic, ///< use those that the cloud has, with signs found anew if these cannot be right, and estimated anew if
             ///< strong noise scatters them; estimate the others
  use,       ///< use them as they are
  reference, ///< estimate, and let the cloud's normals vote on the orientation of each component
  estimate   ///< ignore them
};

struct NormalOptions {
  NormalSource source = NormalSource::automatic;
  float radius = 0;           ///< neighborhood radius, cloud's unit; 0 = by the points' own spacing, or, with
                              ///< noiseCriteria, 2.5 l̄ as in the paper
  bool noiseCriteria = false; ///< drop noise as the paper does: farther than l̄ from the fitted plane, or the smallest
                              ///< eigenvalue explains more than 10 % of the variation
};

struct OrientationOptions {
  float maxAngle = 15; ///< neighbors' normals agree within this angle, degrees, (0, 90]
  /// The origin that a cloud names is its sensor, if it is not zero or the cloud is organized. To tell what was seen
  /// through (see Trimming), so is that of the coordinates if all normals look there.
  bool sensorOrigin = true;

  /// \name What components are; no options of tools
  /// @{
  float neighborDistance = 0;    ///< two points are neighbors if closer, cloud's unit; 0 = by localDistance
  bool localDistance = true;     ///< the automatic distance is five local spacings of each of the two points; false:
                                 ///< the paper's, max(l̄ + 6 σ_l, 2.5 l̄) for all
  bool joinAcrossCreases = true; ///< join components over edges that fail the angle, most parallel first
  float minComponentShare = 0;   ///< drop components with a smaller share of the points, [0, 1); the paper: .01
  /// @}
};

/// Which votes decide the sign of a component.
enum class OrientationVote {
  none,      ///< keep the normals' signs as they are; only the components are computed
  reference, ///< the majority of dot(normal, reference normal)
  sensor,    ///< the majority of dot(normal, sensor - position); where a view is unknown, the nearest sensor counts
  outward    ///< positive signed volume, Σ A (p - centroid)·n > 0 with A the area that a point stands for, where a
             ///< component encloses a volume; see below
};

/// How the points become observations of the field. All but `points` observe one signed distance per voxel near them,
/// made of the distances to the tangent planes of its nearest points, δ_j = n_j·(x − p_j).
enum class ObservationKind {
  points,   ///< at the points themselves: value and gradient, no voxel-wise distances; see point_observation.h
  median,   ///< L1: robust to outliers (the paper's choice)
  mean,     ///< L2: for Gaussian noise
  nearest,  ///< the nearest point's plane alone
  plane,    ///< G: Σ g_j δ_j / Σ g_j, g_j = exp(−t_j²/2s²), t_j the tangential distance to p_j, s = 0.75 l̄
  trapezoid ///< T: the same with δ_j = ½ (n_j + n̄)·(x − p_j), n̄ = unit(Σ g_j n_j); corrects for curvature
};

/// How the confidence falls with t = d_E / dEmax, d_E the distance to the nearest point.
enum class ConfidenceShape {
  linear,   ///< α = 1 − min(t, 1) (the paper's)
  quadratic ///< α = 1 − min(t, 1)²
};

struct ObservationOptions {
  ObservationKind kind = ObservationKind::points;

  // Of observations at the points.
  float smoothing = 0; ///< ℓ, cloud's unit: what is smaller is smoothed away; 0 = by the noise, if it is known, or
                       ///< else chosen by the data
  float noise = 0;     ///< standard deviation of the scanner's noise, cloud's unit; 0 = unknown
  /// What the noise of the points is like, by name and numbers; z is a point's range from its sensor, cloud's unit.
  /// automatic: as the cloud itself shows it. none: left to points that are held out. Where it varies, points weigh by
  /// 1/σ², and the smoothing length is that of the median σ:
  /// constant:S (the same as `noise`), quadratic:A,B (σ = A + B z²), tof:A,B (σ = A + B z, time of flight), kinect:D,F
  /// (σ = D z²/F, disparities off by D pixels, focal length times baseline F pixels; kinect alone: .088, 43.5 m).
  std::string noiseModel = "automatic";
  float gradientWeight = 0; ///< g²/ℓ²: weight of the normals beside that of the positions, ..100; 0 = chosen by the
                            ///< data, or .4 where the smoothing is given or the normals are estimated

  // Of observations at the voxels.
  int neighbors = 5; ///< points per voxel, 1..100

  // Of the confidence: of voxels, and of the surface in colors and trimming.
  float maxDistance = 0; ///< dEmax, cloud's unit; 0 = 3 l̄ (the paper's), 3.25 l̄ for points, plane and trapezoid
  ConfidenceShape confidenceShape = ConfidenceShape::quadratic; ///< no option of tools

  bool atPoints() const { return kind == ObservationKind::points; }
};

/// Order k of the prior; the system's operator is L^k.
enum class Prior {
  membrane = 1,   ///< differences of neighbors (paper Eq. 5, 9, 13)
  thinPlate = 2,  ///< the fixed point of the paper's ICM for its Laplacian prior (Eq. 6)
  triharmonic = 3 ///< the exact minimizer of the sum of Eq. 6 over all voxels
};

/// Which energy is minimized; a = αβ, w = a/(1−a): as the paper's program does it, or as its text writes it, see
/// src/method.md. With paper a β of .9 smooths as one of .82 (k = 1) or .33 with joint.
enum class Energy {
  joint, ///< Eq. 9 / 13: L^k d + c_k W (d − d°) = 0
  paper ///< Eq. 10–11: the minimum of Σ (1−a_i) U(d_i) + a_i (d_i − d°_i)², by every solver but multigrid, which
        ///< conjugate gradients stand in for; for observations at voxels
};

struct PriorOptions {
  Prior kind = Prior::triharmonic;
  float beta = .99f; ///< global weight of the data β, [0, 1); larger trusts the data more
  Energy energy = Energy::joint;
};

enum class SolverMethod {
  multigrid, ///< conjugate gradients preconditioned by one multigrid V-cycle; see grid_solver.h
  icm,       ///< the paper's iterated conditional modes, voxel by voxel in a random order; see solveIcm
  cg,        ///< Fletcher–Reeves conjugate gradients on the energy
  cholesky,  ///< sparse Cholesky factorization by CHOLMOD, of the module libpcl_mrf_cholesky; refused above some 16 s
  icmColors  ///< iterated conditional modes by classes of voxels that do not interact, in parallel
};

/// Whether a method visits voxel after voxel.
inline bool isIcm(SolverMethod method)
{
  return method == SolverMethod::icm || method == SolverMethod::icmColors;
}

struct SolverOptions {
  SolverMethod method = SolverMethod::multigrid;
  int maxIterations = 0;         ///< iterations or sweeps, ≥ 0; 0 = 100 (multigrid; on levels in bands 4, 2, 1),
                                 ///< 1000 (icm), 10000 (cg)
  double changeTolerance = 5e-4; ///< icm and multigrid stop when a step changes d by less, RMS in voxel sides, 4 times
                                 ///< that where points are observed; 0 = never
  std::uint64_t seed = 1;        ///< of icm's visiting order, and of the draws of UncertaintyOptions

  /// \name Of the solvers' inside; no options of tools
  /// @{
  double residualTolerance = 1e-6; ///< multigrid and cg stop at ‖b − A d‖ ≤ this · ‖b‖, (0, 1)
  int smootherDegree = 0; ///< Chebyshev degree before and after in the V-cycle, 0..50; 0 = 2 / 5 / 4 for k = 1 / 2 /
                          ///< 3, on levels in bands 2 / 4 / 5
  bool choleskyOnCoarsest = false; ///< factorize the coarsest level of the multiscale scheme whatever the method
  /// @}
};

/// The finest voxels beside the sampling: each step down costs about 2.5 times the time and memory.
enum class Quality {
  draft,  ///< h = 3 l̄
  normal, ///< as fine as the data carry: h = 2 l̄ or coarser, see HoldOut
  fine    ///< h = 1.5 l̄
};

/// How a level's field becomes what the next finer one starts from.
enum class Interpolation {
  cubic, ///< keeps the curvature that the coarser level has found, so that less is left to solve
  linear ///< the paper's
};

struct MultiscaleOptions {
  Quality quality = Quality::normal;
  float voxelSize = 0;       ///< voxel side of the finest level h, cloud's unit; 0 = by the quality
  int padding = 0;           ///< voxels of the finest level around the points' box, 2..100; 0 = the least, 6, around a
                             ///< box with room beside openings, see volume.h
  std::size_t maxMemory = 0; ///< bytes the levels, and then the remesher, may take; 0 = 80 % of what is free
  /// Levels of more voxels than this are solved in a band around the zero level that the coarser one predicts, the
  /// others everywhere; ≥ 0, 0 = 2^20, or 350 per point where that is less, but at least 2^18. Other solvers than
  /// multigrid, and Energy::paper, always solve everywhere.
  std::int64_t denseVoxels = 0;
  /// Between levels solved everywhere; bands take the cubic one. No option of tools.
  Interpolation interpolation = Interpolation::cubic;
};

enum class Trimming {
  none,     ///< keep all: watertight inside the volume
  holes,    ///< keep hole fillings up to a size, drop extrapolation and components without support
  supported ///< keep only surface that data support
};

struct TrimmingOptions {
  Trimming kind = Trimming::holes;
  float maxHole = 0; ///< largest hole diameter that is kept filled, cloud's unit; 0 = half the diagonal, see trim
  /// Largest width of what is filled of an open surface, cloud's unit: of holes, also those that are joined to the
  /// outside, and of bays. 0 = maxHole if that is given, else 24 % of the diagonal, but 28 local spacings of the points
  /// behind a step in depth and where a sensor would see it edge-on, and nothing where one saw through it.
  float maxGap = 0;
  /// Components with fewer coherent points behind them are dropped, the largest one excepted, 0..1000000; 0 or 1: none
  /// are. Three are enough where no other surface is as close as they are to each other. Not with `none`.
  int minComponentPoints = 12;
  /// What is left is closed, however wide its openings are, as flat as they allow: by the plane of those in a plane. A
  /// sheet that bounds nothing gets a back. Not with UncertaintyOptions::maxError.
  bool watertight = false;
};

struct RemesherOptions {
  int rounds = 6; ///< 0 = do not remesh, 0..1000
  /// Target edge length l, cloud's unit; 0 = median edge of the input mesh, if all voxels had the finest one's size,
  /// and longer where points are sparse, see EdgeSizing.
  float targetEdge = 0;
  /// Triangles to end with, ..1e8; 0 = as many as the edges ask for. The remesher leaves no fewer, then collapses edges
  /// where the surface moves least, beside the points' noise where that is known to vary.
  std::int64_t triangles = 0;
  bool fit = true; ///< triangles lie on the surface in the mean; without, vertices do, as in the paper

  /// Whether a remeshed mesh has its triangles, and not their corners, on the surface in the mean.
  bool fitsTriangles() const { return fit && runs(); }

  bool runs() const { return rounds > 0 || triangles > 0; }
};

/// What sigma is: half of the width of an interval around the vertex, along its normal, that holds the surface in 68 of
/// 100 cases, and twice as wide in 95. Errors of registration, and normals that point to the wrong side, are not in it.
struct UncertaintyOptions {
  bool compute = false; ///< sigma per vertex, and the report's part; needs observations at points
  int samples = 8;      ///< draws from the posterior, 2..1000; their seed is that of the solver
  /// Surfaces that sigma allows for, which come with the result, 0..1000; sigma is computed for them. Where they are
  /// wider than the object is thin, they may intersect.
  int surfaces = 0;
  /// Surface is dropped, on top of what TrimmingOptions drop, whose 95 % half-width exceeds this, cloud's unit, and
  /// with it what hangs on by single triangles; 0: none. Sigma is computed for it.
  float maxError = 0;
};

/// Which colors the output carries.
enum class ColorMode {
  none,       ///< none
  input,      ///< the input's RGB or intensity, interpolated, where it had them
  confidence, ///< α as a color: blue where interpolated, skin where observed (paper Fig. 4)
  sigma       ///< the error bars, which are computed for it: blue where the surface is known best, red where least
};

/// Lengths are in the cloud's unit; 0 means "derived from the sampling density" where the field says so.
struct Options {
  LengthUnit unit = LengthUnit::density; ///< of the automatic lengths
  SearchKind search = SearchKind::bins;  ///< of the nearest points, where no search object is given
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
  std::string confidenceField; ///< field of the cloud that holds per-point confidences 0..1; empty: none
  std::string noiseField; ///< field with the standard deviation of each point's noise, cloud's unit, > 0; empty: none
  int threads = 0;        ///< 0 = one per hardware thread, ..1024
};

/// Whether sigma is computed: on its own, or for the colors, for surfaces drawn with it or a limit to it.
inline bool wantsUncertainty(const Options& options)
{
  return options.uncertainty.compute || options.colors == ColorMode::sigma || options.uncertainty.surfaces > 0 ||
         options.uncertainty.maxError > 0;
}

/// The settings that our measurements recommend; the same as Options().
PCL_MRF_EXPORT Options defaultPreset();

/// The paper's own settings; what they are, and in what they still differ from the paper, is in src/method.md. Needs
/// the module libpcl_mrf_cholesky. PCL's own classes run where the paper's steps are theirs.
PCL_MRF_EXPORT Options paperPreset();

/// The presets by name.
enum class Preset {
  standard, ///< defaultPreset
  paper     ///< paperPreset
};

PCL_MRF_EXPORT Options presetOptions(Preset preset);

/// Validates every stage's options at once.
/// \throw InvalidOption naming the first value that is out of range, its range and the remedy
PCL_MRF_EXPORT void validate(const Options& options);

} // namespace pcl::mrf
