// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief From points to oriented points (paper Sec. 3.1).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

namespace pcl {
namespace mrf {

/// Section 3.1: outliers, normals, components, orientation. Fills the report's density, counts and orientation.
/// \param search is given the points that are left; it holds result.positions on return
/// \throw InvalidInput if too few points are left
OrientedPoints preprocess(PointSet points, const Options& options, NeighborSearch& search, Report& report,
                          Execution& execution);

} // namespace mrf
} // namespace pcl
