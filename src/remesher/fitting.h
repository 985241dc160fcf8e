// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The last pass of the remesher: triangles that cut off as much of the surface as they add.
#pragma once

#include "remesher/remeshed_surface.h"

#include <pcl/surface/mrf/execution.h>

namespace pcl {
namespace mrf {

/// Moves vertices along their normals until the middles of edges lie on the surface in the mean.
///
/// Triangles with their corners on a curved surface lie on one side of it: by l²/8R in the mean, for edges of l on a
/// sphere of radius R, where the best ones of that size are off by less than a third of it, to both sides. A quadratic
/// function's mean over a triangle is that of its values at the middles of the edges, so these stand for all of the
/// triangle. Vertices on the border, pinned ones, and those whose triangles would be spoiled stay where they are, and
/// those along sharp edges of the shape nearly so.
void fitToSurface(RemeshedSurface& surface, Execution& execution);

} // namespace mrf
} // namespace pcl
