// SPDX-License-Identifier: BSD-3-Clause
/// Observes the value and the gradient of the field at the points themselves (ours, beside the paper's Sec. 3.2).
///
/// The energy of a field d, in units of the voxel side h, is
///
///     E(d) = Σ_p ρ_p [ (c_pᵀ d)² + g² ‖G_p d − n_p‖² ] + τ dᵀ L^k d,      τ = q (ℓ/h)^(2k−1),  q = (h/l̄)²/4
///
/// with c_p the 8 trilinear weights at point p, G_p the gradient of the trilinear interpolant, n_p the point's normal,
/// ρ_p its weight, q the number of points per voxel face and ℓ the smoothing length: details smaller than ℓ are
/// smoothed away on every grid. No neighbors are searched.
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

/// A point, or the mean of several points that the grid cannot tell apart.
struct PointSample {
  Eigen::Vector3f position; ///< in voxels, relative to the center of voxel (0, 0, 0)
  Eigen::Vector3f normal;   ///< n_p; the mean of several is shorter than 1
  float weight;             ///< Σ ρ_p

  PointSample() {} // leaves members unset, because clearing millions of samples takes time
  PointSample(const Eigen::Vector3f& at, const Eigen::Vector3f& direction, float mass)
      : position(at), normal(direction), weight(mass)
  {}
};

/// The area that a point stands for, relative to a typical one, 1/16..16. With these weights a sum over the points is
/// an integral over the surface, however unevenly it was sampled.
/// \param localSpacing spacing around the point \param spacing that of a typical point, in the same unit, both > 0
inline float relativeArea(float localSpacing, float spacing)
{
  constexpr float max = 4; // the few points above are outliers, or at the border of the scanned area
  const float ratio = std::clamp(localSpacing / spacing, 1 / max, max);
  return ratio * ratio;
}

/// Weight of a point by its noise: 1/σ² relative to a typical point, ratio of σ in 1/16..16; 1 if either is unknown.
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
  AxisOrder axes = {};                                ///< order in which the lattice stores the points' axes
  const std::vector<std::uint32_t>* chosen = nullptr; ///< indices of the points that count; null: all
  /// Plane of the lattice that is z = 0 in the samples. The place of a point between voxels does not depend on it.
  int firstPlane = 0;

  std::size_t size() const { return chosen ? chosen->size() : points.size(); }
};

/// One sample per point, in the points' order, weighted by confidence, area and noise.
std::vector<PointSample> toSamples(const PointsOnLattice& seen, Execution& execution);

/// merge(toSamples(seen), side), but never with the samples of all points in memory.
std::vector<PointSample> toMergedSamples(const PointsOnLattice& seen, float side, Execution& execution);

/// The samples of a finest level, ordered by cells: one per point; one per cell if voxels are larger than 10 l̄, as a
/// pilot's are.
std::vector<PointSample> samplesOfFinest(const PointsOnLattice& seen, Execution& execution);

/// Merges the samples in each cube of `side` voxels into one at their weighted mean. The result is ordered by cubes: z,
/// then y, then x. A side of ½ changes a field no more than the trilinear interpolant does.
std::vector<PointSample> merge(const std::vector<PointSample>& samples, float side, Execution& execution);

/// The samples of a lattice in voxels of a coarser one, merged. \param side of the cubes to merge, coarse voxels
std::vector<PointSample> coarsened(const std::vector<PointSample>& samples, const Lattice& fine, const Lattice& coarse,
                                   float side, Execution& execution);

/// The same for the samples of points that are seen on the finer lattice.
std::vector<PointSample> toCoarsenedSamples(const PointsOnLattice& seen, const Lattice& coarse, float side,
                                            Execution& execution);

/// Orders samples by the cells of the lattice in which they lie: z, then y, then x.
std::vector<PointSample> sortedByCells(const std::vector<PointSample>& samples, Execution& execution);

/// Min ℓ/h of a coarse level: a smaller one leaves sheets between the points.
constexpr float minSmoothing = .36f;

struct PointWeights {
  double value = 1;    ///< weight of (c_pᵀ d)²: 1/τ
  double gradient = 0; ///< weight of ‖G_p d − n_p‖²: g²/τ, voxels²
};

/// The weights of one level. \param smoothing ℓ, \param spacing l̄, \param voxelSize h, all in one unit, > 0
/// \param gradientWeight g²/ℓ²
PointWeights pointWeights(Prior prior, double smoothing, double spacing, double voxelSize, double gradientWeight);

/// ℓ of a level, cloud's unit: that of the options, but at least minSmoothing · h on a coarse level. \param spacing l̄,
/// \param voxelSize h, cloud's unit, > 0
double levelSmoothing(const ObservationOptions& options, float spacing, double voxelSize, bool isFinest);

/// The weights of a level by the options. \param spacing l̄, \param voxelSize h, cloud's unit, > 0
PointWeights levelWeights(Prior prior, const ObservationOptions& options, float spacing, double voxelSize,
                          bool isFinest);

/// The shortest ℓ that is tried, which suits clean scans: .5 l̄.
double shortestSmoothing(double spacing);

/// Min ℓ for Gaussian noise, as hold-out finds it as well: l̄ · max(.5, 1.5 (σ/l̄)^.4), cloud's unit. The exponent is
/// that of the balance between τ ∝ ℓ^(2k−1) and σ² for k = 3; the factor is measured. \param noise σ, cloud's unit
double smoothingForNoise(double noise, double spacing);

} // namespace pcl::mrf
