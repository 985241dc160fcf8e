// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief How fast edges may get longer along the surface.
#pragma once

#include "remesher/half_edge_mesh.h"

#include <pcl/surface/mrf/execution.h>

namespace pcl {
namespace mrf {

/// Lowers the mesh's sizing until edges aimed at get longer by a fifth of the way along the surface at most: between
/// long and short ones triangles stay nearly equilateral.
/// \param targetEdge where the sizing is 1, cloud's unit, > 0
void limitGrowth(HalfEdgeMesh& mesh, float targetEdge, Execution& execution);

} // namespace mrf
} // namespace pcl
