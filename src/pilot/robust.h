// SPDX-License-Identifier: BSD-3-Clause
/// Finds points that a robust field does not pass: structured outliers that no filter of spacings sees (ours).
///
/// Clusters of false matches are as dense as the surface, but a smooth field through all other points passes far from
/// them. The field is solved with Geman–McClure weights ρ = (c²/(c² + r²))² of the residuals r. c falls from solve to
/// solve (graduated non-convexity), so that the start does not matter. The other points are reconstructed as always.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Flags the points to keep: those whose distance to the robust field's zero level is at most five standard deviations
/// of all distances (by their median) or 1.1 h, whichever is more. Components of fewer than .15 % of the points, or
/// fewer than 50, hardly weigh in the field.
/// \param spacing l̄, \param voxelSize h of the finest level, cloud's unit, > 0
/// \param search holds points.positions \param maxMemory of a solution, as MultiscaleOptions::maxMemory
/// \throw ResourceLimit if a solution takes more memory, or is out of proportion to the points
/// Cost: five solutions of the thin-plate prior at twice the voxel size, an eighth of the voxels.
std::vector<std::uint8_t> keptByField(const OrientedPoints& points, const NeighborSearch& search, float spacing,
                                      double voxelSize, std::size_t maxMemory, Execution& execution);

} // namespace pcl::mrf
