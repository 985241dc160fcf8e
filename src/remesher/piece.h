// SPDX-License-Identifier: BSD-3-Clause
/// Remeshing a whole mesh, or a part of it with what is around that.
#pragma once

#include "base/loops.h"
#include "remesher/half_edge_mesh.h"
#include "remesher/plan.h"
#include "remesher/remesher.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace pcl::mrf {

/// A mesh, and what is known of its vertices; all empty: nothing.
struct MeshPiece {
  TriangleMesh mesh; ///< vertices and triangles
  EdgeSizing sizing;
  /// Of a part, \see HalfEdgeMesh::numbers. Vertices that may move have all their neighbors, and those that are joined
  /// to them all their triangles.
  std::vector<std::int32_t> numbers;
  std::vector<double> places; ///< of a part, on the plan's curves
};

struct RemeshedPiece : MeshPiece {
  RemeshSummary summary;
  std::vector<std::int32_t> intersecting; ///< triangles, ascending
  std::int64_t intersectingBefore = 0;    ///< of a whole mesh, \see RemeshResult
};

/// Moves positions to the surface, if it is near.
inline BorderCurves::OnSurface surfaceFinder(const ZeroLevel& level, Poller& poll)
{
  return [&](Eigen::Vector3f& position) {
    poll();
    const std::optional<Corner> reached = level.trace(position);
    if (reached)
      position = reached->position;
    return reached.has_value();
  };
}

/// Runs all passes. A part comes out with the vertices that have numbers where they were, and the triangles between
/// these.
RemeshedPiece remeshPiece(const MeshPiece& piece, const RemeshPlan& plan, const ZeroLevel& level,
                          const RemesherOptions& options, Execution& execution);

} // namespace pcl::mrf
