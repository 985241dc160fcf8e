// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Self-intersections of a mesh of which only some triangles are new.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

/// As selfIntersectingTriangles, of the pairs of which at least one is marked.
/// \param marked by triangle; empty: all are
std::vector<std::int32_t> intersectingTriangles(const TriangleMesh& mesh, const std::vector<std::uint8_t>& marked,
                                                Execution& execution);

} // namespace mrf
} // namespace pcl
