// SPDX-License-Identifier: BSD-3-Clause
/// Finds the components of a mesh that enough points support, and that no line of sight contradicts (trimming).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// A mesh, and of each triangle whether points support it.
struct ObservedMesh {
  const TriangleMesh& mesh;
  const std::vector<std::uint8_t>& supported;
};

/// Clears the flags of the triangles in components that too few points support, or that lines of sight contradict; none
/// if minComponentPoints is below 2. The component with the largest supported area always stays.
/// \param keep flags of the triangles that form the components
/// \param isTorn receives whether the kept triangles around some vertex fall into several fans
/// \return the number of components that it dropped
std::int64_t dropSmallComponents(const ObservedMesh& observed, const OrientedPoints& points,
                                 const NeighborSearch& search, const TrimmingOptions& options,
                                 std::vector<std::uint8_t>& keep, bool& isTorn, Execution& execution);

} // namespace pcl::mrf
