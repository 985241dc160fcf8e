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

/// Makes normals consistent inside each connected component and decides the sign of each component by a vote.
///
/// Edges join points closer than the neighbor distance, best first: the more parallel two normals are after reflection
/// at the edge's bisector plane, and the less the edge leaves the tangent planes, the better. Creases come late, edges
/// along both normals last. Without a vote no sign is changed. Opposite sheets closer than about twice l̄ cannot be told
/// apart by their points. How each vote decides, and where we differ from the paper: src/method.md.
/// \param normals unit length, one per point, as estimated or as they came; a zero normal joins nothing and is dropped
/// \param vote OrientationVote::sensor needs points.sensors, reference needs points.normals
/// \throw InvalidOption as validate does; InvalidInput if what the vote needs is missing
/// Cost: one 13-neighbor query per point, and sorting about 7 edges per point; without a vote one 5-neighbor query.
/// The result does not depend on the number of threads or, up to ties, on the order of the points.
OrientationResult orientNormals(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                                const NeighborSearch& search, const SamplingDensity& density, OrientationVote vote,
                                const OrientationOptions& options, Execution& execution);

} // namespace pcl::mrf
