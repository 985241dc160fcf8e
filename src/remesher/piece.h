// SPDX-License-Identifier: BSD-3-Clause
/// Remeshing of a whole mesh, or of a part of it with its surroundings.
#pragma once

#include "base/loops.h"
#include "mesh/vertex_fields.h"
#include "remesher/border_curves.h"
#include "remesher/half_edge_mesh.h"
#include "remesher/remesher.h"
#include "remesher/zero_level.h"

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <optional>
#include <vector>

namespace pcl::mrf {

/// Values that hold for a whole mesh, in however many parts it is remeshed.
struct RemeshPlan {
  float targetEdge = 0;   ///< target edge length where the sizing is 1, cloud's unit
  float maxTurn = 0;      ///< max TriangleShape::turn of new triangles
  double triangles = 0;   ///< number of them if all edges had their target length
  bool pinsFolds = false; ///< whether triangles that face against the surface's normals stay, if they are few
  EdgeSizing sizing;      ///< of the mesh's vertices; empty: 1 everywhere
  /// For decimation, as in remesh().
  DistanceWeight weightAt;
  /// For each border vertex the next one on the border, −1 for the other vertices.
  std::vector<std::int32_t> nextOnBorder;
  BorderCurves curves; ///< for parts only: a whole mesh makes its own
};

/// \param field from which the mesh was extracted: larger voxels have made longer edges
/// \throw InvalidInput if the mesh is not oriented and manifold
/// \throw ResourceLimit if the target edge asks for more triangles than can be indexed
RemeshPlan planFor(const TriangleMesh& mesh, const DistanceField& field, const EdgeSizing& sizing,
                   const RemesherOptions& options, Execution& execution);

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
