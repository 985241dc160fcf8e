// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Observed signed distance and local confidence per voxel (paper Sec. 3.2 and 3.3.3).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/export.h>
#include <pcl/surface/mrf/lattice.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

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
  float gradientWeight = 0; ///< g²/ℓ²: weight of the normals beside that of the positions, ..100; 0 = chosen by the
                            ///< data, or .4 where the smoothing is given or the normals are estimated. Coarse levels
                            ///< take ten times as much where bands of order 3 refine them to voxels of at most 2.4
                            ///< spacings

  // Of observations at the voxels.
  int neighbors = 5;          ///< points per voxel, 1..100
  bool scaleWithLevel = true; ///< coarser levels, and their automatic dEmax, reach at least 1.5 h of the level

  // Of the confidence: of voxels, and of the surface in colors and trimming.
  float maxDistance =
      0; ///< dEmax, cloud's unit; 0 = 3 l̄ (the paper's), 3.25 l̄ for points, plane and trapezoid (measured)
  ConfidenceShape confidenceShape = ConfidenceShape::quadratic;

  bool atPoints() const { return kind == ObservationKind::points; }
};

/// \throw InvalidOption naming the first field that is out of range
PCL_MRF_EXPORT void validate(const ObservationOptions& options);

/// dEmax of the finest level, cloud's unit: the option, or its automatic value.
PCL_MRF_EXPORT float resolvedMaxDistance(const ObservationOptions& options, float spacing, float voxelSize);

/// α at a distance from the nearest point. \param share d_E / dEmax, ≥ 0 \return 0..1
inline float confidenceAt(float share, ConfidenceShape shape)
{
  const float t = std::min(share, 1.f);
  return shape == ConfidenceShape::linear ? 1 - t : 1 - t * t;
}

/// ℓ, cloud's unit: the option, or by the option's noise, or .5 l̄, which suits clean scans.
PCL_MRF_EXPORT float resolvedSmoothing(const ObservationOptions& options, float spacing);

/// g²/ℓ²: the option, or .4, which suits clean scans.
inline float resolvedGradientWeight(const ObservationOptions& options)
{
  return options.gradientWeight > 0 ? options.gradientWeight : .4f;
}

/// What was observed, for the voxels with α > 0 only; all others carry no weight and are not stored.
struct Observation {
  Lattice lattice;
  std::vector<std::int64_t> voxels; ///< ascending indices into the lattice
  std::vector<float> distances;     ///< d°, cloud's unit, negative inside; one per voxel listed
  std::vector<float> confidences;   ///< α, (0, 1]
};

/// Observes the field at the voxels of one lattice. \pre the kind is not `points`
/// \param search holds exactly points.positions
/// \param spacing l̄, cloud's unit
/// \param maxDistance dEmax for this level, cloud's unit, > 0
/// Cost: about (dEmax/h)³ per point and one query per observed voxel.
/// The result does not depend on the number of threads.
PCL_MRF_EXPORT Observation observe(const OrientedPoints& points, const NeighborSearch& search, const Lattice& lattice,
                                   float spacing, float maxDistance, const ObservationOptions& options,
                                   Execution& execution);

} // namespace mrf
} // namespace pcl
