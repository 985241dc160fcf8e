// SPDX-License-Identifier: BSD-3-Clause
/// The surface of a triangle mesh, for remeshing without a field.
#pragma once

#include "remesher/reference_surface.h"

#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Nearest points of a mesh by a tree of boxes around its triangles; normals are those of the vertices, or else of the
/// triangles around them, interpolated. Building takes n log n, a query about log n for n triangles.
class TriangleSurface : public ReferenceSurface {
public:
  /// \param mesh must outlive this; triangles whose corners are no vertices, or not finite, are left out
  TriangleSurface(const TriangleMesh& mesh, float maxStep);

  Eigen::Vector3f normalAt(const Eigen::Vector3f& position, const Eigen::Vector3f& fallback) const override;
  std::optional<Corner> trace(const Eigen::Vector3f& start) const override;
  float height(const Eigen::Vector3f& position) const override;

private:
  struct Node {
    Eigen::Vector3f lower, upper;
    std::int32_t begin, end; ///< of the leaf's triangles in order_; none: an inner node
    std::int32_t right = 0;  ///< the other child is the next node
  };

  /// A point of the mesh, by the weights of the corners of a triangle.
  struct Place {
    float squaredDistance;
    std::int32_t triangle = -1; ///< there is none
    Eigen::Vector3f weights = Eigen::Vector3f::Zero();
  };

  void build(std::int32_t begin, std::int32_t end, const std::vector<Eigen::Vector3f>& centers);
  const Eigen::Vector3f& corner(std::int32_t triangle, std::size_t number) const;
  void offer(std::int32_t triangle, const Eigen::Vector3f& query, Place& nearest) const;
  /// The nearest point that is closer than a squared distance.
  Place nearest(const Eigen::Vector3f& query, float limit) const;
  Eigen::Vector3f normalOf(const Place& place) const;

  const TriangleMesh& mesh_;
  std::vector<Eigen::Vector3f> normals_; ///< of the vertices
  std::vector<std::int32_t> order_;      ///< triangles, those of a leaf one behind the other
  std::vector<Node> nodes_;              ///< the root first
};

/// Median length of the mesh's edges, those between two triangles twice; 0 without triangles.
float medianEdge(const TriangleMesh& mesh);

} // namespace pcl::mrf
