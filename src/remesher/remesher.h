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

/// Weight, > 0, of squared distances from the surface at a position, relative to other positions. Empty: the same
/// everywhere. Called from several threads at once.
using DistanceWeight = std::function<double(const Eigen::Vector3f&)>;

struct RemeshResult : RemeshSummary {
  TriangleMesh mesh;                   ///< vertices and triangles only
  std::int64_t intersectingBefore = 0; ///< of the input; without parts only where intersections are expected
  std::int64_t intersecting = 0;       ///< intersecting triangles of the result

  const RemeshSummary& summary() const { return *this; }

  /// Adds the operations on another mesh.
  void add(const RemeshSummary& other)
  {
    splits += other.splits;
    collapses += other.collapses;
    flips += other.flips;
    refusedOperations += other.refusedOperations;
  }
};

/// Makes triangles nearly equilateral and of one size on the zero level: rounds of splits, collapses, flips and
/// relaxation, each vertex traced back to d = 0. Borders are remeshed as curves, ears and claws keep their length, and
/// at the end triangles are fitted to the surface in the mean (ours; see src/method.md).
///
/// An operation is refused if it would turn a triangle over, or create a non-manifold edge or vertex or a duplicate
/// triangle. No self-intersection is created. The topology (components, genus, boundary loops) is kept. Vertices and
/// triangles are in the order of a space-filling curve.
/// \param mesh oriented and manifold, as polygonize gives it
/// \param sizing target length of the edges around each vertex, relative to the target edge, ≥ 1; empty: 1 everywhere.
/// Growth over a fifth of the distance along the surface is limited. Ignored if RemesherOptions::targetEdge is given
/// \param partSize triangles per part, about; 0, or at least the triangles of input and result: no parts. Parts take
/// 120 bytes per vertex of the mesh and 200 per triangle of a part, a whole mesh takes 420 per vertex; the triangles
/// that result differ. With RemesherOptions::triangles the last collapses are on the whole mesh
/// \param weightAt with RemesherOptions::triangles: a larger weight lets a collapse move the surface less
/// \throw InvalidInput if the mesh is not oriented and manifold, or the field is empty
/// \throw InvalidOption; ResourceLimit if the target edge asks for more triangles than can be indexed; Cancelled
/// Cost: linear in the number of triangles per round. The result does not depend on the number of threads.
RemeshResult remesh(TriangleMesh mesh, const DistanceField& field, const EdgeSizing& sizing,
                    const RemesherOptions& options, Execution& execution, std::int64_t partSize = 0,
                    const DistanceWeight& weightAt = {});

} // namespace pcl::mrf
