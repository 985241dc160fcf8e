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
  std::int64_t droppedByStatistics = 0; ///< without those dropped as alone
};

/// Finds points that lie apart from the others. A point is alone (ours) if it is far from its 8 nearest neighbors and
/// no surface goes through it at any scale, see src/method.md. PCL's statistical criterion is not robust: a few far
/// outliers inflate its standard deviation until nothing is dropped. Duplicates count as neighbors at distance 0.
/// \param distances of the points; may be empty unless options.alone \param search holds exactly points.positions
OutlierResult findOutliers(const PointSet& points, const NeighborDistances& distances, const NeighborSearch& search,
                           const OutlierOptions& options, Execution& execution);

} // namespace pcl::mrf
