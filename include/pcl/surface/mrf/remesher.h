/// \file
/// \brief Isotropic remeshing on the zero level of the field (paper Sec. 3.5, after Botsch and Kobbelt).
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/mesh_quality.h>
#include <pcl/surface/mrf/triangle_mesh.h>

namespace pcl {
namespace mrf {

struct RemesherOptions {
  int rounds = 10;      ///< 0 = do not remesh, 0..1000
  float targetEdge = 0; ///< target edge length l, cloud's unit; 0 = median edge of the input mesh
  float relaxation = 1; ///< share of the tangential step that is taken, (0, 1]
};

/// \throw InvalidOption naming the first field that is out of range
void validate(const RemesherOptions& options);

struct RemeshResult {
  TriangleMesh mesh; ///< vertices and triangles only
  std::int64_t splits = 0, collapses = 0, flips = 0;
  std::int64_t refusedOperations = 0; ///< that would have flipped a triangle, broken the topology or left the surface
  std::int64_t intersectingBefore = 0, intersecting = 0; ///< triangles that meet others where they should not
  double targetEdge = 0;                                 ///< that was used
};

/// Makes triangles nearly equilateral and of one size without leaving the zero level.
///
/// A round: split edges longer than 4/3 l, collapse edges shorter than 4/5 l, flip edges towards valence 6 (4 on the
/// boundary), relax each vertex to the area-weighted centroid of its neighbours in its tangent plane (normal from the
/// field), trace it back to d = 0 by a Runge–Kutta integration along ∇d / |∇d|².
/// An operation that would turn a triangle over, create a non-manifold edge or vertex, a duplicate triangle or a
/// self-intersection is refused: every operation is checked against the former triangles and the field's normals, and a
/// round after which triangles intersect is repeated with the mesh around them left alone. What intersects in the input
/// may remain. Boundary vertices stay where they are; a long boundary edge is split in its middle if that is on the
/// surface, none is collapsed or flipped. The topology (components, genus, boundary loops) is kept.
/// \param mesh oriented and manifold, as polygonize gives it
/// \throw InvalidInput if the mesh is not oriented and manifold, or the field is empty
/// \throw InvalidOption; ResourceLimit if the target edge asks for more triangles than can be indexed; Cancelled
/// Vertices and triangles come out in the order of a space-filling curve.
/// Cost: linear in the number of triangles per round; relaxation, renumbering and the search for intersections run in
/// parallel. The result does not depend on the number of threads.
RemeshResult remesh(const TriangleMesh& mesh, const DistanceField& field, const RemesherOptions& options,
                    Execution& execution);

/// Traces a position to the zero level along the (not unit-length) gradient, fourth-order Runge–Kutta.
/// \param maxStep the result is at most this far from the position
/// \return the position unchanged if the zero level is not reached
Eigen::Vector3f traceToZeroLevel(const DistanceField& field, const Eigen::Vector3f& position, float maxStep);

} // namespace mrf
} // namespace pcl
