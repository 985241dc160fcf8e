// SPDX-License-Identifier: BSD-3-Clause
/// Points that a robust field cannot agree with: structured outliers that no filter of spacings sees (ours).
///
/// Clusters of false matches are as dense as the surface. What tells them is that a smooth field through all other
/// points passes them by. The field is solved five times on a coarse level with the thin-plate prior and Geman–McClure
/// weights ρ = (c²/(c² + r²))² of the residuals r, c falling from solve to solve (graduated non-convexity), so that it
/// does not matter where it starts. The result is only used to reject points: what is left is reconstructed as always.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Flags the points to keep: those closer to the robust field's zero level than five standard deviations of the points
/// (by their median) or 1.1 h, whichever is more. Components of less than .15 % of the points, or less than 50, have no
/// say in the field: only what the others say about them counts.
/// \param spacing l̄, \param voxelSize h of the finest level, cloud's unit, > 0
/// \param search holds points.positions \param maxMemory as MultiscaleOptions::maxMemory, of a solution
/// \throw ResourceLimit if a solution takes more, or is out of proportion to the points
/// Cost: five solutions of the thin-plate prior at twice the voxel size, an eighth of the voxels.
std::vector<std::uint8_t> keptByField(const OrientedPoints& points, const NeighborSearch& search, float spacing,
                                      double voxelSize, std::size_t maxMemory, Execution& execution);

} // namespace pcl::mrf
