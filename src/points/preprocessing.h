// SPDX-License-Identifier: BSD-3-Clause
/// From gathered points to points with normals that are yet to be oriented (paper Sec. 3.1).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Fewer points than a plane's neighborhood cannot tell a surface.
constexpr std::size_t minPointsOfSurface = 4;

/// Keeps the flagged points and hands them to the search; both stay as they are if all are kept.
/// \return whether some were dropped
bool reduce(PointSet& points, const std::vector<std::uint8_t>& keep, NeighborSearch& search, Execution& execution);

/// \throw InvalidInput if too few points are left for a surface
void requirePoints(const PointSet& points, const Report& report);

struct PreparedPoints {
  PointSet points;
  std::vector<Eigen::Vector3f> normals; ///< of each point, unit; see Report for those whose signs are not yet decided
};

/// Drops outliers, measures the sampling density and finds normals; the report gets density and counts, and what the
/// cloud's normals lacked.
/// \param search is given the points that are left \throw InvalidInput if too few are
PreparedPoints preprocess(PointSet points, const Options& options, NeighborSearch& search, Report& report,
                          Execution& execution);

} // namespace pcl::mrf
