// SPDX-License-Identifier: BSD-3-Clause
/// Observing the field at the points themselves: its value and its gradient (ours, beside the paper's Sec. 3.2).
///
/// The energy of a field d, in units of the voxel side h, is
///
///     E(d) = Σ_p ρ_p [ (c_pᵀ d)² + g² ‖G_p d − n_p‖² ] + τ dᵀ L^k d,      τ = q (ℓ/h)^(2k−1),  q = (h/l̄)²/4
///
/// with c_p the 8 trilinear weights at point p, G_p the gradient of the trilinear interpolant, n_p the point's normal,
/// ρ_p its confidence, q the number of points per voxel face and ℓ the smoothing length: what is smaller than ℓ is
/// smoothed away, on every grid alike. No neighbor is searched.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/lattice.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// ⌊coordinate⌋; std::floor is a call on the baseline processor. \pre it fits an int
inline int floorOf(float coordinate)
{
  const auto truncated = static_cast<int>(coordinate);
  return truncated - (coordinate < static_cast<float>(truncated) ? 1 : 0);
}

/// A point, or the mean of several that the grid does not tell apart.
struct PointSample {
  Eigen::Vector3f position; ///< in voxels, relative to the center of voxel (0, 0, 0)
  Eigen::Vector3f normal;   ///< n_p; the mean of several is shorter than 1
  float weight;             ///< Σ ρ_p

  PointSample() {} // not set: clearing millions first takes time
  PointSample(const Eigen::Vector3f& at, const Eigen::Vector3f& direction, float mass)
      : position(at), normal(direction), weight(mass)
  {}
};

/// The area that each point stands for beside that of a typical one, 1/16..16: the sum over the points is the integral
/// over the surface, however unevenly it was sampled.
/// \param localSpacing, spacing of the points around it and of a typical one, one unit, > 0
inline float relativeArea(float localSpacing, float spacing)
{
  constexpr float max = 4; // the few points of more are outliers, or at the border of what was seen
  const float ratio = std::clamp(localSpacing / spacing, 1 / max, max);
  return ratio * ratio;
}

/// What a point weighs by its noise: 1/σ² beside a typical one's, where that is known. Ratios of σ above 16 count
/// as 16.
inline float relativePrecision(float deviation, float typical)
{
  constexpr float max = 16;
  if (!(typical > 0) || !(deviation > 0))
    return 1;
  const float ratio = std::clamp(typical / deviation, 1 / max, max);
  return ratio * ratio;
}

/// Points as a lattice sees them.
struct PointsOnLattice {
  const OrientedPoints& points;
  const Lattice& lattice;
  float spacing;                                      ///< l̄, cloud's unit
  AxisOrder axes = {};                                ///< of the points in the order of the lattice
  const std::vector<std::uint32_t>* chosen = nullptr; ///< indices of the points that count; none: all
  /// Of the lattice, that samples count planes from: to the bit as from another, wherever points lie between voxels.
  int firstPlane = 0;

  std::size_t size() const { return chosen ? chosen->size() : points.size(); }
};

/// One sample per point, in their order, weighted by confidence, area and noise.
std::vector<PointSample> toSamples(const PointsOnLattice& seen, Execution& execution);

/// The same merged as by merge, without the samples of all points beside them.
std::vector<PointSample> toMergedSamples(const PointsOnLattice& seen, float side, Execution& execution);

/// The samples of a finest level, by cells: one per point, or per cell where voxels hold so many that each need not be
/// seen, as a pilot's do.
std::vector<PointSample> samplesOfFinest(const PointsOnLattice& seen, Execution& execution);

/// One sample for all within the same cube of `side` voxels, at their weighted mean; ordered by cubes: z, then y, then
/// x. A side of ½ changes a field no more than the trilinear interpolant does.
std::vector<PointSample> merge(const std::vector<PointSample>& samples, float side, Execution& execution);

/// The samples of a lattice as a coarser one sees them, merged. \param side of the cubes of which one is left, voxels
std::vector<PointSample> coarsened(const std::vector<PointSample>& samples, const Lattice& fine, const Lattice& coarse,
                                   float side, Execution& execution);

/// The same of points that are seen on the finer lattice.
std::vector<PointSample> toCoarsenedSamples(const PointsOnLattice& seen, const Lattice& coarse, float side,
                                            Execution& execution);

/// Orders samples by the cells of the lattice they lie in: z, then y, then x.
std::vector<PointSample> sortedByCells(const std::vector<PointSample>& samples, Execution& execution);

/// The least ℓ/h of a coarse level: less leaves sheets between the points.
constexpr float minSmoothing = .36f;

struct PointWeights {
  double value = 1;    ///< of (c_pᵀ d)², 1/τ
  double gradient = 0; ///< of ‖G_p d − n_p‖², g²/τ, voxels²
};

/// The weights of one level. \param smoothing ℓ, \param spacing l̄, \param voxelSize h, all in one unit, > 0
/// \param gradientWeight g², voxels²
PointWeights pointWeights(Prior prior, double smoothing, double spacing, double voxelSize, double gradientWeight);

/// ℓ of a level, cloud's unit: that of the options, on a coarse level at least minSmoothing h. \param spacing l̄,
/// \param voxelSize h, cloud's unit, > 0
double levelSmoothing(const ObservationOptions& options, float spacing, double voxelSize, bool isFinest);

/// The weights of a level as the options have them; parameters likewise.
PointWeights levelWeights(Prior prior, const ObservationOptions& options, float spacing, double voxelSize,
                          bool isFinest);

/// The shortest ℓ that is tried, which suits clean scans: .5 l̄.
double shortestSmoothing(double spacing);

/// The ℓ that Gaussian noise asks for at least, and points left out see as well: l̄ · max(.5, 1.5 (σ/l̄)^.4), cloud's
/// unit.
/// The exponent is that of the balance between τ ∝ ℓ^(2k−1) and σ² for k = 3; the factor is measured.
double smoothingForNoise(double noise, double spacing);

} // namespace pcl::mrf
