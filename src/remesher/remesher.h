// SPDX-License-Identifier: BSD-3-Clause
/// Isotropic remeshing on the zero level of the field (paper Sec. 3.5, after Botsch and Kobbelt).
#pragma once

#include "mesh/vertex_fields.h"

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <Eigen/Core>

#include <functional>

namespace pcl::mrf {

/// What a squared distance from the surface weighs at a position, > 0, relative to other positions. Empty: all the
/// same. Called from several threads at once.
using DistanceWeight = std::function<double(const Eigen::Vector3f&)>;

struct RemeshResult : RemeshSummary {
  TriangleMesh mesh;                   ///< vertices and triangles only
  std::int64_t intersectingBefore = 0; ///< triangles that meet others, as far as sheets are close there, or on a border
  std::int64_t intersecting = 0;       ///< those of the result, all of them

  const RemeshSummary& summary() const { return *this; }

  /// Adds what was done to another mesh.
  void add(const RemeshSummary& other)
  {
    splits += other.splits;
    collapses += other.collapses;
    flips += other.flips;
    refusedOperations += other.refusedOperations;
  }
};

/// Makes triangles nearly equilateral and of one size, on the zero level: rounds of splits, collapses, flips and
/// relaxation, each vertex traced back to d = 0. Borders are remeshed as curves, what sticks out keeps its length, in
/// the end triangles are fitted to the surface in the mean (ours; see src/method.md).
///
/// An operation that would turn a triangle over, or create a non-manifold edge or vertex or a duplicate triangle, is
/// refused; no self-intersection is created; the topology (components, genus, boundary loops) is kept. Vertices and
/// triangles come out in the order of a space-filling curve.
/// \param mesh oriented and manifold, as polygonize gives it
/// \param sizing of edges around each vertex, relative to the target edge, from 1 on; empty: 1 everywhere. It grows by
/// a fifth of the way along the surface at most. RemesherOptions::targetEdge, if it is given, goes for all edges
/// \param partSize triangles of a part, about; 0, or as many as the mesh has and gets: it stays whole. In parts it
/// takes 120 bytes for each of its vertices and 200 for each triangle of a part beside it, as a whole 420 for each of
/// its vertices; triangles differ. With RemesherOptions::triangles the last collapses are on the whole mesh
/// \param weightAt with RemesherOptions::triangles: where the surface may move less for a collapse
/// \throw InvalidInput if the mesh is not oriented and manifold, or the field is empty
/// \throw InvalidOption; ResourceLimit if the target edge asks for more triangles than can be indexed; Cancelled
/// Cost: linear in the number of triangles per round. The result does not depend on the number of threads.
RemeshResult remesh(TriangleMesh mesh, const DistanceField& field, const EdgeSizing& sizing,
                    const RemesherOptions& options, Execution& execution, std::int64_t partSize = 0,
                    const DistanceWeight& weightAt = {});

} // namespace pcl::mrf
