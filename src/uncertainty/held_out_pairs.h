// SPDX-License-Identifier: BSD-3-Clause
/// What pairs of points that a field has not seen say about it, and about the scanner.
#pragma once

#include "options/resolved_options.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>

#include <vector>

namespace pcl::mrf {

/// Two points next to each other that were left out, and how far the field is from each, along its gradient, signed.
/// The scanner's noise is another one at each; what they share is the field's error.
struct HeldOutPair {
  Eigen::Vector3f position; ///< on the field's zero level, beside the first
  float first, second;      ///< cloud's unit
  float square() const { return .5f * (first * first + second * second); }
  float shared() const { return first * second; }
};

/// Leaves out a tenth of the points, by pairs, in up to 24 balls of 22 voxels spread over the cloud, and solves each
/// anew on the finest level's voxels.
/// \param spacing l̄, cloud's unit
/// The result does not depend on the number of threads. The cost does not grow with the cloud.
std::vector<HeldOutPair> holdOutPairs(const OrientedPoints& points, const NeighborSearch& search, float spacing,
                                      const ResolvedOptions& options, Execution& execution);

} // namespace pcl::mrf
