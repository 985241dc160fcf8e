// SPDX-License-Identifier: BSD-3-Clause
/// The zero level of a field that is stored in voxels of several sizes.
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

namespace pcl::mrf {

/// polygonize() for a field with coarser bands. A cell has the size of the voxels of the band that holds it: a power of
/// two times the finest. Cells of different sizes use the same vertices on the edges that they share, and the same
/// segments between them, so that the mesh has no cracks.
/// \pre the field's axes are in the order of its storage, and it has a coarser band
TriangleMesh polygonizeOctree(const DistanceField& field, Execution& execution);

} // namespace pcl::mrf
