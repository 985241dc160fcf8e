// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Outlier removal before anything is estimated from the points.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/export.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/sampling_density.h>

#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

/// Criteria are independent; a point is dropped if any enabled one rejects it. A share above 2 % is a warning of the
/// report, with the rule's name.
struct OutlierOptions {
  bool alone = true;               ///< no coherent neighbors, and far from them beside their own or the cloud's spacing
  float aloneFactor = 2.7f;        ///< so many times as far, > 1; 2 drops 1 to 3 % of real clouds
  bool spacing = false;            ///< mean distance to the neighbors against a multiple of its median over all points
  int spacingNeighbors = 8;        ///< number of neighbors, 1..1000
  float spacingFactor = 3;         ///< multiple of the median, > 1
  bool statistical = false;        ///< PCL's StatisticalOutlierRemoval
  int statisticalNeighbors = 8;    ///< its setMeanK, 1..1000
  float statisticalDeviations = 3; ///< its setStddevMulThresh, > 0
  bool robust = false;             ///< by a robust field, once the points are oriented; see robust.h
};

/// \throw InvalidOption naming the first field that is out of range
PCL_MRF_EXPORT void validate(const OutlierOptions& options);

struct OutlierResult {
  std::vector<std::uint8_t> keep; ///< one flag per point
  std::int64_t droppedAlone = 0;
  std::int64_t droppedBySpacing = 0;    ///< of those that are left
  std::int64_t droppedByStatistics = 0; ///< likewise
};

/// Finds points that lie apart from the others.
///
/// A point is alone (ours) if two things speak against it. It is far from its 8 nearest neighbors: their mean distance
/// exceeds aloneFactor times the median of theirs (a local outlier factor), or of all points'. And no surface goes
/// through it: fewer than five of the eight lie in its tangent plane with normals like its own (by the planes of the 13
/// nearest points where the points have none), or fewer than three of those stay. So a wall that is scanned sparsely,
/// the bottom of a pocket that few rays reach and a patch of six points stay, however small they are beside the cloud;
/// a share of the cloud, or a spacing beside its median alone, is no evidence against a point.
///
/// The spacing criterion (ours) is robust where the mean and standard deviation of PCL's are not: a few far outliers
/// inflate the deviation until nothing is dropped. Duplicates count as neighbors at distance 0.
/// \param search holds exactly points.positions
PCL_MRF_EXPORT OutlierResult findOutliers(const PointSet& points, const NeighborSearch& search,
                                          const OutlierOptions& options, Execution& execution);

/// The same from distances that have been measured, or none, if no point is to be alone.
PCL_MRF_EXPORT OutlierResult findOutliers(const PointSet& points, const NeighborDistances& distances,
                                          const NeighborSearch& search, const OutlierOptions& options,
                                          Execution& execution);

} // namespace mrf
} // namespace pcl
