// SPDX-License-Identifier: BSD-3-Clause
/// Connected components of a point set and consistent orientation of its normals (paper Sec. 3.1).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// The option, or its automatic value, cloud's unit; of local distances the median.
float resolvedNeighborDistance(const OrientationOptions& options, const SamplingDensity& density);

struct OrientationResult : OrientationSummary {
  std::vector<Eigen::Vector3f> normals; ///< consistently oriented, unit; one per point
  std::vector<std::uint8_t> keep;       ///< 0 for points of small components

  const OrientationSummary& summary() const { return *this; }
};

/// Makes normals consistent inside each connected component, along edges between close points, best first, and decides
/// the sign of each component by a vote; without one no sign is changed. How, and where we differ from the paper:
/// src/method.md. Opposite sheets closer than about twice l̄ cannot be told apart by their points.
/// \param normals unit length, one per point, as estimated or as they came; a zero normal joins nothing and is dropped
/// \param vote OrientationVote::sensor needs points.sensors, reference needs points.normals
/// \throw InvalidOption as validate does; InvalidInput if what the vote needs is missing
/// Cost: one 13-neighbor query per point, and sorting about 7 edges per point; without a vote one 5-neighbor query.
/// The result does not depend on the order of the points, up to ties.
OrientationResult orientNormals(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                                const NeighborSearch& search, const SamplingDensity& density, OrientationVote vote,
                                const OrientationOptions& options, Execution& execution);

} // namespace pcl::mrf
