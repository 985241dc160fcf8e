// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief PCL's Poisson reconstruction of plain points.
#pragma once

#include "support/surface_mesh.h"

#include <vector>

namespace mrf_apps {

/// pcl::Poisson with its own defaults apart from the depth of its octree, in a frame about the first point.
/// \throw pcl::mrf::InvalidInput if it gives no surface
SurfaceMesh poisson(const std::vector<Eigen::Vector3d>& positions, const std::vector<Eigen::Vector3d>& normals,
                    int depth);

} // namespace mrf_apps
