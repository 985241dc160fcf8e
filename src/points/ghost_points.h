// SPDX-License-Identifier: BSD-3-Clause
/// Finds what was not there while other sensors looked: people and things that moved during a scan.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Clears `keep` of the points that other sensors saw through, see src/method.md, "Outliers". points.views tell which
/// sensor saw a point; without them, and with more than 256 sensors, no point is dropped. \param normals of any sign
/// \param search holds the points \pre points.spacings is not empty \return number of points dropped
///
/// Cost: some 10 ns for each pair of a point and a sensor, and a query for each point that some sensor saw through.
std::int64_t dropGhosts(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                        const NeighborSearch& search, std::vector<std::uint8_t>& keep, Execution& execution);

} // namespace pcl::mrf
