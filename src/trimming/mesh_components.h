// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Which components of a mesh have points that speak for them (trimming).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

/// Clears the flags of the triangles in components that too few points speak for or with too little supported area; the
/// largest one, by that area, always stays.
/// \param supported, areas per triangle \param keep flags of the triangles that there are
/// \param isTorn receives whether the kept triangles around some vertex fall into several fans
/// \return how many components it dropped
std::int64_t dropSmallComponents(const TriangleMesh& mesh, const OrientedPoints& points, const NeighborSearch& search,
                                 const std::vector<std::uint8_t>& supported, const std::vector<double>& areas,
                                 const TrimmingOptions& options, std::vector<std::uint8_t>& keep, bool& isTorn,
                                 Execution& execution);

} // namespace mrf
} // namespace pcl
