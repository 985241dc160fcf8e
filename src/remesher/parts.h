// SPDX-License-Identifier: BSD-3-Clause
/// Remeshing a mesh part after part.
#pragma once

#include "remesher/part_cutting.h"
#include "remesher/piece.h"
#include "remesher/zero_level.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// A mesh in the making, and what its vertices carry from one run over its parts to the next.
struct PartedMesh {
  TriangleMesh mesh;
  EdgeSizing sizing;          ///< empty: 1
  std::vector<double> places; ///< on the plan's curves; empty if there are none
  PartNumbers seams;          ///< whose seam a vertex is on that could not move yet; empty before the first run
};

/// Remeshes each part with all else left as it is: what is joined to vertices of other parts, or of none, stays. So
/// parts are joined by the vertices and triangles that stay, bit by bit. A part that comes to intersect another one is
/// made once more, with what is around left as it was. \param result gets what was done added
void remeshParts(PartedMesh& mesh, const PartNumbers& parts, const RemeshPlan& plan, const ZeroLevel& level,
                 const RemesherOptions& options, RemeshResult& result, Execution& execution);

/// Remeshes in parts, then strips along their seams until no vertex is left that could not move.
/// \param options without triangles to end with
RemeshResult remeshInParts(TriangleMesh mesh, RemeshPlan plan, const ZeroLevel& level, const RemesherOptions& options,
                           std::int64_t trianglesOfPart, Execution& execution);

} // namespace pcl::mrf
