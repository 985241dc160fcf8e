// SPDX-License-Identifier: BSD-3-Clause
/// Observed signed distance and local confidence per voxel (paper Sec. 3.2 and 3.3.3).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/lattice.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// dEmax of the finest level, cloud's unit: the option, or its automatic value.
float resolvedMaxDistance(const ObservationOptions& options, float spacing, float voxelSize);

/// ℓ, cloud's unit: the option or, by the option's noise σ, l̄ · max(.5, 1.5 (σ/l̄)^.4, 1.7 (σ/l̄)^.6). .5 l̄ suits
/// clean scans.
float resolvedSmoothing(const ObservationOptions& options, float spacing);

/// g²/ℓ²: the option, or .4, which suits clean scans.
inline float resolvedGradientWeight(const ObservationOptions& options)
{
  return options.gradientWeight > 0 ? options.gradientWeight : .4f;
}

/// The observed distances at the voxels with α > 0. The other voxels have no weight and are not stored.
struct Observation {
  Lattice lattice;
  std::vector<std::int64_t> voxels; ///< ascending indices into the lattice
  std::vector<float> distances;     ///< d°, cloud's unit, negative inside; one per voxel listed
  std::vector<float> confidences;   ///< α, (0, 1]
};

/// Observes the field at the voxels of one lattice. \pre the kind is not ObservationKind::points
/// \param search holds exactly points.positions
/// \param spacing l̄, cloud's unit
/// \param maxDistance dEmax for this level, cloud's unit, > 0
/// Cost: about (dEmax/h)³ per point and one query per observed voxel.
/// The result does not depend on the number of threads.
Observation observe(const OrientedPoints& points, const NeighborSearch& search, const Lattice& lattice, float spacing,
                    float maxDistance, const ObservationOptions& options, Execution& execution);

} // namespace pcl::mrf
