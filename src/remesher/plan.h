// SPDX-License-Identifier: BSD-3-Clause
/// Values that hold for a whole mesh, in however many parts it is remeshed.
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

} // namespace pcl::mrf
