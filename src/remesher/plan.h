// SPDX-License-Identifier: BSD-3-Clause
/// What holds for all of a mesh, in however many parts it is remeshed.
#pragma once

#include "mesh/vertex_fields.h"
#include "remesher/border_curves.h"
#include "remesher/remesher.h"
#include "remesher/zero_level.h"

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

struct RemeshPlan {
  float targetEdge = 0;   ///< where the sizing is 1, cloud's unit
  float maxTurn = 0;      ///< for triangles to be made \see TriangleShape::turn
  double triangles = 0;   ///< equilateral ones that there would be, all edges as long as their target
  bool pinsFolds = false; ///< whether triangles that run against the surface's normals stay, if they are few
  EdgeSizing sizing;      ///< of the mesh's vertices; empty: 1 everywhere
  /// For decimation.
  DistanceWeight weightAt;
  /// Of each vertex on the border the one that follows, −1 for the others.
  std::vector<std::int32_t> nextOnBorder;
  BorderCurves curves; ///< for parts only: a whole mesh has its own
};

/// \param field that the mesh was cut out of: where it has larger voxels, so are the mesh's edges
/// \throw InvalidInput if the mesh is not oriented and manifold
/// \throw ResourceLimit if the target edge asks for more triangles than can be indexed
RemeshPlan planFor(const TriangleMesh& mesh, const DistanceField& field, const EdgeSizing& sizing,
                   const RemesherOptions& options, Execution& execution);

} // namespace pcl::mrf
