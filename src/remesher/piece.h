// SPDX-License-Identifier: BSD-3-Clause
/// Remeshing of a whole mesh, or of a part of it with its surroundings.
#pragma once

#include "base/loops.h"
#include "remesher/half_edge_mesh.h"
#include "remesher/plan.h"
#include "remesher/remesher.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace pcl::mrf {

/// A mesh with values of its vertices; arrays without values are empty.
struct MeshPiece {
  TriangleMesh mesh; ///< vertices and triangles
  EdgeSizing sizing;
  /// In a part only, \see HalfEdgeMesh::numbers. The part holds all neighbors of the vertices that may move, and all
  /// triangles of these neighbors.
  std::vector<std::int32_t> numbers;
  std::vector<double> places; ///< in a part only, on the plan's curves
};

struct RemeshedPiece : MeshPiece {
  RemeshSummary summary;
  std::vector<std::int32_t> intersecting; ///< triangles, ascending
  std::int64_t intersectingBefore = 0;    ///< for a whole mesh only, \see RemeshResult
};

/// Makes a function that moves positions to the surface if it is near.
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

/// Runs all passes. In a part, the vertices that have numbers stay where they are; so do the triangles between them.
RemeshedPiece remeshPiece(const MeshPiece& piece, const RemeshPlan& plan, const ZeroLevel& level,
                          const RemesherOptions& options, Execution& execution);

} // namespace pcl::mrf
