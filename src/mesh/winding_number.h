// SPDX-License-Identifier: BSD-3-Clause
/// How often a surface, which may be open, winds around a position.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// The generalized winding number (Jacobson, Kavan and Sorkine-Hornung 2013): the signed solid angle of a mesh seen
/// from a position, over 4π. It is 1 inside of a closed mesh and 0 outside. For an open mesh it has a step of 1 at the
/// mesh and is harmonic elsewhere: its level ½ spans the openings, a planar one by its plane.
///
/// Distant triangles count in groups, each as a dipole (Barill et al. 2018), with an error of some hundredths.
class WindingNumber {
public:
  /// \pre all triangles have valid indices, and the mesh outlives this. Cost: n log n.
  WindingNumber(const TriangleMesh& mesh, Execution& execution);

  /// Cost: about log n. May be called concurrently.
  double at(const Eigen::Vector3f& place) const;

private:
  /// A group of consecutive triangles in order_. If it is no leaf, the nodes of its two halves follow it.
  struct Node {
    Eigen::Vector3f center = Eigen::Vector3f::Zero(), areaVector = Eigen::Vector3f::Zero();
    float radius = 0; ///< of a ball around the center that holds all corners
    std::int32_t begin = 0, end = 0;
    std::int32_t next = 0; ///< the first node after those of its halves
  };

  void build(std::int32_t begin, std::int32_t end);
  double solidAngle(std::int32_t triangle, const Eigen::Vector3f& place) const;

  const TriangleMesh& mesh_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

} // namespace pcl::mrf
