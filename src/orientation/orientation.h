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

/// The neighbor distance: the option or its automatic value, cloud's unit; the median if distances are local.
float resolvedNeighborDistance(const OrientationOptions& options, const SamplingDensity& density);

struct OrientationResult : OrientationSummary {
  std::vector<Eigen::Vector3f> normals; ///< consistently oriented, unit; one per point
  std::vector<std::uint8_t> keep;       ///< 0 for points of small components
  double minorityShare = 0;             ///< of the points: sign unlike that of most points of their component

  const OrientationSummary& summary() const { return *this; }
};

/// Makes normals consistent inside each connected component, along edges between close points, best edges first. A vote
/// decides the sign of each component; for OrientationVote::none no sign is changed. See src/method.md for the method
/// and where it differs from the paper. Opposite sheets closer than about twice l̄ cannot be told apart.
/// \param normals unit length, one per point, estimated or given; a point with a zero normal is dropped
/// \param vote OrientationVote::sensor needs points.sensors, reference needs points.normals
/// \throw InvalidOption as validate does; InvalidInput if the arrays that the vote needs are missing
/// Cost: one 13-neighbor query per point, and sorting about 7 edges per point; without a vote one 5-neighbor query.
/// The result does not depend on the order of the points, up to ties.
OrientationResult orientNormals(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                                const NeighborSearch& search, const SamplingDensity& density, OrientationVote vote,
                                const OrientationOptions& options, Execution& execution);

} // namespace pcl::mrf
