/// \file
/// \brief Exact self-intersections of a triangle mesh through CGAL, to judge our own code with.
#pragma once

#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace oracle {

/// Indices, ascending, of the triangles that are degenerate, that intersect a triangle without a common vertex, or that
/// share vertices with one (by index) and meet it in more than these. Exact predicates; any soup of triangles will do.
std::vector<std::int32_t> selfIntersectingTriangles(const pcl::mrf::TriangleMesh& mesh);

} // namespace oracle
