// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Does a segment hit a triangle: a bounding volume hierarchy over a triangle soup.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {
namespace scan {

/// Built by the surface area heuristic over binned centroids: n log n for n triangles. Queries are thread-safe.
class TriangleTree {
public:
  /// \param triangles indices into vertices
  TriangleTree(const std::vector<Eigen::Vector3d>& vertices, const std::vector<std::array<std::int32_t, 3>>& triangles);

  /// True if the segment origin + t · direction meets a triangle other than `excluded` with tMin < t < 1.
  bool isHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double tMin, std::int64_t excluded) const;

  /// The first triangle on a segment; negative: there is none.
  struct Hit {
    double t = 1; ///< of the segment's length
    std::int64_t triangle = -1;
  };

  /// The triangle that the segment origin + t · direction, 0 < t < 1, meets first; of equals that with the smaller
  /// index.
  Hit firstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

private:
  /// Boxes are single precision, rounded outwards, so that two nodes share a cache line.
  struct Node {
    std::array<float, 3> lower, upper;
    std::int32_t first; ///< of the leaf's triangles, or the left child; the right one follows it
    std::int32_t count; ///< triangles; 0 for an inner node
  };
  struct Facet {
    Eigen::Vector3d corner, edge1, edge2;
    std::int64_t triangle;
  };
  struct Builder;

  struct Ray;

  /// Calls visit(triangle, t) for triangles that the segment may meet at t, and for others with t ≥ 1 or t ≤ 0; it
  /// returns up to where the segment still matters, 0 to end.
  template <typename Visit>
  void traverse(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, const Visit& visit) const;

  /// Where the segment meets the facet; 1 or more: it does not.
  static double meets(const Facet& facet, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

  std::vector<Node> nodes_;
  std::vector<Facet> facets_;
};

} // namespace scan
} // namespace mrf
} // namespace pcl
