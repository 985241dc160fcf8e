/// \file
/// \brief Self-intersections of a triangle mesh.
#pragma once

#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

/// Indices, ascending, of the triangles that intersect another triangle without sharing a vertex with it, or that
/// intersect a triangle sharing a vertex in more than what they share.
/// Cost: uniform bins, about linear for meshes of even triangle size.
std::vector<std::int32_t> selfIntersectingTriangles(const TriangleMesh& mesh);

} // namespace mrf
} // namespace pcl
