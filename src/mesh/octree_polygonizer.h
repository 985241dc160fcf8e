// SPDX-License-Identifier: BSD-3-Clause
/// The zero level of a field that is stored in voxels of several sizes.
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

namespace pcl::mrf {

/// As polygonize() does. Cells are as large as the voxels of the band that holds them, a power of two on the finest
/// lattice. Cells of different size see the same vertices on the edges that they share, and the same segments between
/// them, so that the mesh has no cracks. \pre the field's axes are those of its storage, and it has a coarser band
TriangleMesh polygonizeOctree(const DistanceField& field, Execution& execution);

} // namespace pcl::mrf
