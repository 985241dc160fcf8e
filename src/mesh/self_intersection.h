// SPDX-License-Identifier: BSD-3-Clause
/// Self-intersections of a triangle mesh.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Ascending indices of the triangles that intersect another one in more than the vertices and edges they share.
/// Triangles are closed sets, so touching counts; the decisions are exact. A degenerate triangle counts as its edges
/// and is not compared with another degenerate one; a triangle with a vertex that is not finite is left out.
/// \param marked flags of triangles: only pairs with a marked triangle count; empty: all pairs
/// Cost: about linear for meshes of even triangle size. The result does not depend on the number of threads.
std::vector<std::int32_t> selfIntersectingTriangles(const TriangleMesh& mesh, Execution& execution,
                                                    const std::vector<std::uint8_t>& marked = {});

/// The same on the calling thread.
std::vector<std::int32_t> selfIntersectingTriangles(const TriangleMesh& mesh);

} // namespace pcl::mrf
