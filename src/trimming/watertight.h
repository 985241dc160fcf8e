// SPDX-License-Identifier: BSD-3-Clause
/// A closed surface around the volume that an open one bounds (ours).
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

namespace pcl::mrf {

/// A field with a closed zero level: near the mesh that of the given field, elsewhere a level of the mesh's winding
/// number, see src/method.md, "Trimming".
///
/// The closed level lies in the convex hull of the mesh, up to about a voxel. The field is stored in a band around it,
/// on the lattice of the given one with two more voxels on each side. Each piece of a field in pieces is closed by
/// itself; pieces without a part of the mesh are left out.
/// \param mesh part of the zero level of the field, as polygonize made it \pre it has triangles
/// Cost: for the n voxels of the band n log m, m the triangles of the mesh, in memory some 40 bytes per voxel. The
/// result does not depend on the number of threads.
DistanceField closeOpenings(const TriangleMesh& mesh, const DistanceField& field, Execution& execution);

} // namespace pcl::mrf
