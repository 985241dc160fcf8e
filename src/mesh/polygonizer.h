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
/// d < 0 is inside. Each lattice edge whose ends differ in sign has one vertex, at the linear zero crossing, which is
/// kept away from the ends; all cells around the edge share it. The mesh is oriented, has no degenerate triangle, no
/// non-manifold edge and no non-manifold vertex, and is closed except where the zero level leaves the field's cells.
/// Only vertices and triangles are set. A field in pieces gives one mesh of all pieces.
/// \return an empty mesh if no cell contains a sign change
/// Cost: linear in the number of cells. The result does not depend on the number of threads.
TriangleMesh polygonize(const DistanceField& field, Execution& execution);

/// polygonize() for a field with coarser bands. A cell has the size of the voxels of the band that holds it: a power of
/// two times the finest. Cells of different sizes use the same vertices on the edges that they share, and the same
/// segments between them, so that the mesh has no cracks.
/// \pre the field's axes are in the order of its storage, and it has a coarser band
TriangleMesh polygonizeOctree(const DistanceField& field, Execution& execution);

} // namespace pcl::mrf
