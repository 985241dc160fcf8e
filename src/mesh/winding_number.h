// SPDX-License-Identifier: BSD-3-Clause
/// How often a surface, which may be open, winds around a place.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// The generalized winding number (Jacobson, Kavan and Sorkine-Hornung 2013): the signed solid angle that a mesh takes
/// up in the view from a place, over 4π. Inside of a closed mesh it is 1, outside 0. That of an open mesh has a step of
/// 1 at the mesh and is harmonic elsewhere: its level ½ spans the openings, those in a plane by that plane.
///
/// Triangles far away count in groups, each as a dipole (Barill et al. 2018), to some hundredths.
class WindingNumber {
public:
  /// \pre all triangles have valid indices. Cost: n log n. The mesh is read from as long as this lives.
  WindingNumber(const TriangleMesh& mesh, Execution& execution);

  /// Cost: about log n. May be called concurrently.
  double at(const Eigen::Vector3f& place) const;

private:
  /// Of consecutive triangles of the order; the nodes of its halves follow it, if it has more than a leaf's.
  struct Node {
    Eigen::Vector3f center = Eigen::Vector3f::Zero(), areaVector = Eigen::Vector3f::Zero();
    float radius = 0; ///< around the center, holds all corners
    std::int32_t begin = 0, end = 0;
    std::int32_t next = 0; ///< the node behind those of its halves
  };

  void build(std::int32_t begin, std::int32_t end);
  double solidAngle(std::int32_t triangle, const Eigen::Vector3f& place) const;

  const TriangleMesh& mesh_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

} // namespace pcl::mrf
