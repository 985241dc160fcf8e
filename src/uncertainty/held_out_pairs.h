// SPDX-License-Identifier: BSD-3-Clause
/// The errors of a field at pairs of held-out points, which tell the surface's error from the scanner's noise.
#pragma once

#include "options/resolved_options.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include <vector>

namespace pcl::mrf {

/// Two neighboring points that were held out, and their signed distances from the field's zero level, along its
/// gradient. The scanner's noise differs between the two; the part that they share is the field's error.
struct HeldOutPair {
  Eigen::Vector3f position; ///< on the field's zero level, next to the first point
  float first, second;      ///< cloud's unit
  float square() const { return .5f * (first * first + second * second); }
  float shared() const { return first * second; }
};

/// Holds out a tenth of the points, in pairs, in up to 24 balls of 22 voxels in diameter spread over the cloud, and
/// solves each ball without them with the finest level's voxels.
/// \param spacing l̄, cloud's unit
/// The result does not depend on the number of threads. The cost does not grow with the cloud.
std::vector<HeldOutPair> holdOutPairs(const OrientedPoints& points, const NeighborSearch& search, float spacing,
                                      const ResolvedOptions& options, Execution& execution);

} // namespace pcl::mrf
