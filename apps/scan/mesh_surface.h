// SPDX-License-Identifier: BSD-3-Clause
/// A triangle mesh as a surface to scan.
#pragma once

#include "surface.h"

#include <unsupported/Eigen/BVH>

#include <array>
#include <vector>

namespace pcl::mrf::scan {

/// Triangles are counter-clockwise seen from outside. Rays are traced through Eigen's tree of boxes.
class MeshSurface : public Surface {
public:
  /// \pre corners are vertices \throw InvalidInput if a coordinate is not finite or the mesh has no area
  MeshSurface(std::vector<Eigen::Vector3d> vertices, std::vector<std::array<std::int32_t, 3>> triangles);

  Triangles triangulate() const override { return {vertices_, triangles_}; }
  double drawnArea() const override { return areas_.back(); }
  bool sample(const Draw& draw, SurfacePoint& point) const override;
  bool isOccluded(const SurfacePoint& point, const Eigen::Vector3d& from) const override;
  bool firstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, SurfacePoint& point) const override;
  Box boundingBox() const override { return box_; }

private:
  struct Facet {
    Eigen::Vector3d corner, edge1, edge2;
    Eigen::Vector3d doubleArea() const { return edge1.cross(edge2); }
  };
  struct Segment;
  Facet facet(std::size_t triangle) const;

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<std::array<std::int32_t, 3>> triangles_;
  std::vector<double> areas_; ///< cumulative
  Box box_;
  Eigen::KdBVH<double, 3, std::int32_t> tree_; ///< of the triangles
};

} // namespace pcl::mrf::scan
