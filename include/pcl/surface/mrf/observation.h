/// \file
/// \brief Observed signed distance and local confidence per voxel (paper Sec. 3.2 and 3.3.3).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/lattice.h>
#include <pcl/surface/mrf/neighbour_search.h>
#include <pcl/surface/mrf/point_set.h>

#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

/// How the distances to the tangent planes of the nearest points become one. δ_j = n_j·(x − p_j).
enum class Estimate {
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
  Estimate estimate = Estimate::plane;
  int neighbours = 5;    ///< points per voxel, 1..100
  float maxDistance = 0; ///< dEmax, cloud's unit; 0 = 3 l̄ (the paper's), 3.25 l̄ for plane and trapezoid (measured)
  bool scaleWithLevel = true; ///< coarser levels, and an automatic dEmax, reach at least 1.5 h of the level
  ConfidenceShape confidenceShape = ConfidenceShape::quadratic;
};

/// \throw InvalidOption naming the first field that is out of range
void validate(const ObservationOptions& options);

/// dEmax of the finest level, cloud's unit: the option, or its automatic value.
float resolvedMaxDistance(const ObservationOptions& options, float spacing, float voxelSize);

/// What was observed, for the voxels with α > 0 only; all others carry no weight and are not stored.
struct Observation {
  Lattice lattice;
  std::vector<std::int64_t> voxels; ///< ascending indices into the lattice
  std::vector<float> distances;     ///< d°, cloud's unit, negative inside; one per voxel listed
  std::vector<float> confidences;   ///< α, (0, 1]
};

/// Observes the field on one lattice.
/// \param search holds exactly points.positions
/// \param spacing l̄, cloud's unit
/// \param maxDistance dEmax for this level, cloud's unit, > 0
/// Cost: about (dEmax/h)³ per point and one query per observed voxel.
/// The result does not depend on the number of threads.
Observation observe(const OrientedPoints& points, const NeighbourSearch& search, const Lattice& lattice, float spacing,
                    float maxDistance, const ObservationOptions& options, Execution& execution);

} // namespace mrf
} // namespace pcl
