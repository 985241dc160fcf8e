// SPDX-License-Identifier: BSD-3-Clause
/// Finds points that were measured many times, as by a scanner that stands still (ours).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// The number of copies k after which the points of a cloud have a gap: in the median, the 2k-th neighbor is more than
/// three times as far away as the k-th. \return a power of two up to 256; 0 if there is no gap, and for fewer than
/// 1,024 points.
/// \param search holds exactly positions
///
/// Cost: the 512 nearest of 64 points.
int countNearCopies(const std::vector<Eigen::Vector3f>& positions, const NeighborSearch& search);

/// Clears the flags of all points of each group of copies but the one next to their mean. See src/method.md, "Sampling
/// density". Copies whose normals point to opposite sides, as on a thin sheet, are of two groups.
/// \param search holds exactly points.positions \param copies as countNearCopies() returns it, above 0
/// \return the number of flags cleared \throw Cancelled
/// Cost: two queries per group. The result depends on the order of the points.
std::int64_t dropNearCopies(const PointArrays& points, const NeighborSearch& search, int copies,
                            std::vector<std::uint8_t>& keep, Execution& execution);

} // namespace pcl::mrf
