// SPDX-License-Identifier: BSD-3-Clause
/// Zero level of a distance field as a closed, oriented, manifold triangle mesh (paper Sec. 3.5, after
/// Bloomenthal).
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

namespace pcl::mrf {

/// Extracts the zero level.
///
/// d < 0 is inside. A vertex sits on each edge of the lattice whose ends differ in sign, at the
/// linear zero crossing kept inside (0, 1); edges are the keys, so that cells share vertices exactly. The mesh is
/// oriented, has no degenerate triangle, no non-manifold edge and no non-manifold vertex, and is closed except where
/// the zero level leaves the field's cells. Sets vertices and triangles only, of a field in pieces those of all.
/// \return an empty mesh if no cell contains a sign change
/// Cost: linear in the number of cells. The result does not depend on the number of threads.
TriangleMesh polygonize(const DistanceField& field, Execution& execution);

} // namespace pcl::mrf
