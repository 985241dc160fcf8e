// SPDX-License-Identifier: BSD-3-Clause
/// Exact self-intersections of a triangle mesh by CGAL, to check meshes and our own code.
#pragma once

#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace exact {

/// Indices, ascending, of the triangles that are degenerate, that intersect a triangle without a common vertex, or that
/// share vertices with one (by index) and intersect it elsewhere. Predicates are exact; any triangle soup will do.
/// Triangles with a vertex that is not finite are left out.
std::vector<std::int32_t> selfIntersectingTriangles(const pcl::mrf::TriangleMesh& mesh);

/// Indices, ascending, of the triangles whose finite corners lie on one line.
std::vector<std::int32_t> degenerateTriangles(const pcl::mrf::TriangleMesh& mesh);

} // namespace exact
