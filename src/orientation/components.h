// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The components of points whose normals need no turning.
#pragma once

#include "orientation/orientation.h"
#include "orientation/orientation_graph.h"

#include <pcl/surface/mrf/options.h>

namespace pcl::mrf {

/// The components of points whose signs are known: no edge has to be sorted, or kept. Normals stay as they are.
/// \param minCosine of the angle that the paper allows between neighbors
/// The result does not depend on the number of threads.
OrientationResult findComponents(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                                 const NeighborSearch& search, const Reach& reach, float minCosine,
                                 const OrientationOptions& options, Execution& execution);

} // namespace pcl::mrf
