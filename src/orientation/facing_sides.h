// SPDX-License-Identifier: BSD-3-Clause
/// The relative signs of the large parts of a graph, by the sheets that lie behind each other (ours).
#pragma once

#include "orientation/orientation_graph.h"

#include <array>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Trees of at least a tenth of the points, the sides, are joined last: first two whose sheets lie behind or before
/// each other, so that both face apart, then by the best edges. Around the sharp rim of a thin object edges lead along
/// a single sheet that is no side of it, and join the sides the wrong way however good they are.
class FacingSides {
public:
  FacingSides(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, const NeighborSearch& search,
              const Reach& reach)
      : points_(points), normals_(normals), search_(search), reach_(reach)
  {}

  /// Whether an edge is between two sides. The first, that is the best, one of each two is noted.
  bool isBetween(const Edge& edge, SignedForest& trees);

  /// Joins the sides. \param areas that the points stand for, up to a common factor
  /// Cost: some thousand queries, if there are several sides.
  void join(const OrientationGraph& graph, const std::vector<float>& areas, SignedForest& trees) const;

private:
  /// What the sheets of two sides say about each other.
  struct Facing {
    std::uint32_t a, b;                ///< roots
    std::array<double, 2> votes{0, 0}; ///< for equal signs, and for opposite ones

    bool isOpposite() const { return votes[1] > votes[0]; }
    bool isDecisive() const;
  };
  struct Side {
    std::uint32_t root;
    std::vector<std::uint32_t> points;
    bool isOpen; ///< it encloses nothing
  };

  bool isSide(std::uint32_t size) const;
  std::vector<Side> findSides(const std::vector<float>& areas, SignedForest& trees) const;
  std::vector<Facing> ask(const std::vector<Side>& sides, const OrientationGraph& graph, SignedForest& trees) const;
  std::uint32_t nextSheet(std::uint32_t i, Neighbors& around) const;
  bool isNoted(std::uint32_t a, std::uint32_t b, SignedForest& trees) const;

  const PointSet& points_;
  const std::vector<Eigen::Vector3f>& normals_;
  const NeighborSearch& search_;
  const Reach& reach_;
  std::vector<Edge> between_;
};

} // namespace pcl::mrf
