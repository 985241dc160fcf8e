// SPDX-License-Identifier: BSD-3-Clause
/// A closed surface around what an open one bounds (ours).
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

namespace pcl::mrf {

/// A field whose zero level is closed: near the mesh that of the field; elsewhere the level ½ of the mesh's winding
/// number, which spans an opening in a plane by that plane, and others like a membrane. Where the mesh bounds a hollow,
/// as a room seen from within, it is the level −½, and the hollow is outside. A sheet that bounds nothing gets a back
/// some two voxels behind it, in steps of voxels.
///
/// The closed level lies in the convex hull of the mesh, but for about a voxel. The field is stored in a band around it
/// on the lattice of the given one, which is two voxels wider to each side. Of a field in pieces each is closed by
/// itself, and those without a part of the mesh are left out.
/// \param mesh part of the zero level of the field, as polygonize made it \pre it has triangles
/// Cost: for the n voxels of the band n log m, m the triangles of the mesh, in memory some 40 bytes per voxel. The
/// result does not depend on the number of threads.
DistanceField closeOpenings(const TriangleMesh& mesh, const DistanceField& field, Execution& execution);

} // namespace pcl::mrf
