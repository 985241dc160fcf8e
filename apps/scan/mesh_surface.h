// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief A triangle mesh as a surface to scan.
#pragma once

#include "surface.h"
#include "triangle_tree.h"

#include <array>
#include <vector>

namespace pcl {
namespace mrf {
namespace scan {

/// Triangles are counter-clockwise seen from outside. Vertices at the same place count as one for the direction of
/// displacement, so that a soup of triangles does not tear.
class MeshSurface : public Surface {
public:
  /// \throw InvalidInput if an index is out of range, a coordinate is not finite or the mesh has no area
  MeshSurface(std::vector<Eigen::Vector3d> vertices, std::vector<std::array<std::int32_t, 3>> triangles);

  double drawnArea() const override { return areas_.back(); }
  bool sample(const Draw& draw, SurfacePoint& point) const override;
  bool isOccluded(const SurfacePoint& point, const Eigen::Vector3d& from) const override;
  bool firstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, SurfacePoint& point) const override;
  Box boundingBox() const override { return box_; }

private:
  void setVertexNormals();
  std::size_t triangleAt(double area) const;

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<std::array<std::int32_t, 3>> triangles_;
  std::vector<Eigen::Vector3d> vertexNormals_; ///< weighted by area
  std::vector<double> areas_;                  ///< cumulative
  std::vector<std::uint32_t> guide_;           ///< first triangle that can contain each equal share of the area
  Box box_;
  TriangleTree tree_;
};

} // namespace scan
} // namespace mrf
} // namespace pcl
