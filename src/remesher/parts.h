// SPDX-License-Identifier: BSD-3-Clause
/// Remeshing of a mesh part by part.
#pragma once

#include "remesher/part_cutting.h"
#include "remesher/piece.h"
#include "remesher/zero_level.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// A mesh while it is remeshed, with the values of its vertices that each run over the parts hands to the next.
struct PartedMesh {
  TriangleMesh mesh;
  EdgeSizing sizing;          ///< empty: 1
  std::vector<double> places; ///< on the plan's curves; empty if there are none
  PartNumbers seams;          ///< part on whose seam a vertex is that could not move yet; empty before the first run
};

/// Remeshes each part and keeps all else. A vertex stays if it is joined to a vertex of another part, or of none, so
/// that parts fit together exactly at their seams. If a part then intersects another one, it is remeshed again, with
/// the vertices around the intersection kept. \param result the counts of operations are added to it
void remeshParts(PartedMesh& mesh, const PartNumbers& parts, const RemeshPlan& plan, const ZeroLevel& level,
                 const RemesherOptions& options, RemeshResult& result, Execution& execution);

/// Remeshes in parts, then in strips along their seams, until every vertex was free to move once.
/// \param options with triangles = 0: without decimation
RemeshResult remeshInParts(TriangleMesh mesh, RemeshPlan plan, const ZeroLevel& level, const RemesherOptions& options,
                           std::int64_t trianglesOfPart, Execution& execution);

} // namespace pcl::mrf
