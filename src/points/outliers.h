// SPDX-License-Identifier: BSD-3-Clause
/// Outlier removal before anything is estimated from the points.
#pragma once

#include "points/sampling_density.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

struct OutlierResult {
  std::vector<std::uint8_t> keep; ///< one flag per point
  std::int64_t droppedAlone = 0;
  std::int64_t droppedByStatistics = 0; ///< of those that are left
};

/// Finds points that lie apart from the others.
///
/// A point is alone (ours) if two things speak against it. It is far from its 8 nearest neighbors: their mean distance
/// exceeds 2.7 times the median of theirs (a local outlier factor), or of all points'. And no surface goes
/// through it, at any scale: fewer than five of the eight lie in its tangent plane with normals like its own (by the
/// planes of the 13 nearest points where the points have none), or fewer than three of those stay; and none of the 16,
/// 32, 64 and 128 nearest lie in a layer that it is in as well. So a rough wall that is scanned sparsely, the bottom of
/// a pocket that few rays reach and a patch of six points stay, however small they are beside the cloud; a share of the
/// cloud, or a spacing beside its median alone, is no evidence against a point.
///
/// PCL's criterion is not robust: a few far outliers inflate its standard deviation until nothing is dropped.
/// Duplicates count as neighbors at distance 0.
/// \param search holds exactly points.positions
OutlierResult findOutliers(const PointSet& points, const NeighborDistances& distances, const NeighborSearch& search,
                           const OutlierOptions& options, Execution& execution);

} // namespace pcl::mrf
