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

/// Min number of points of a surface.
constexpr std::size_t minPointsOfSurface = 4;

/// Keeps the flagged points, also in the search. Does nothing if all are flagged.
/// \return whether points were dropped
bool reduce(PointSet& points, const std::vector<std::uint8_t>& keep, NeighborSearch& search, Execution& execution);

/// \throw InvalidInput if too few points are left for a surface
void requirePoints(const PointSet& points, const Report& report);

struct PreparedPoints {
  PointSet points;
  std::vector<Eigen::Vector3f> normals; ///< one per point, unit; signs are arbitrary if Report::normalsEstimated
};

/// Drops outliers, measures the sampling density and finds normals. The report receives the density, the counts, and
/// warnings about missing normals. \param search is given the points that are left
/// \throw InvalidInput if too few are left, if there are no normals to use, or if lengths do not fit single precision
PreparedPoints preprocess(PointSet points, const Options& options, NeighborSearch& search, Report& report,
                          Execution& execution);

} // namespace pcl::mrf
