// SPDX-License-Identifier: BSD-3-Clause
/// The relative signs of the large parts of a graph, by the sheets that lie behind each other (ours).
#pragma once

#include "orientation/orientation_graph.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Trees of at least a tenth of the points, the sides, are joined last: first two whose sheets lie behind or before
/// each other, so that both face apart, then what lies outside of one that bulges, as a table does beneath a ball, so
/// that both face each other, then by the best edges. Edges that lead around the sharp rim of a thin object, or from
/// one object to another that it touches, join sides the wrong way however good they are.
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
    double asked = 0;                  ///< points

    bool isOpposite() const { return votes[1] > votes[0]; }
    double share() const { return std::max(votes[0], votes[1]) / std::max(1., asked); }
    /// Four in five agree, and so large a share of those that were asked.
    bool isDecisive(double ofAsked) const;
  };
  struct Side {
    std::uint32_t root;
    std::vector<std::uint32_t> points;
    bool isOpen = false; ///< it encloses nothing
    int outward = 0;     ///< the sign of its tree's normals that face out of it; 0 if it hardly bulges
  };

  bool isSide(std::uint32_t size) const;
  Eigen::Vector3f normalOf(std::uint32_t i, SignedForest& trees) const;
  std::vector<Side> findSides(const std::vector<float>& areas, SignedForest& trees) const;
  void describe(Side& side, const std::vector<float>& areas, SignedForest& trees) const;
  std::vector<Facing> askBehind(const std::vector<Side>& sides, const OrientationGraph& graph,
                                SignedForest& trees) const;
  Facing askAround(const Edge& edge, const Side& side, SignedForest& trees) const;
  void joinAtContacts(const std::vector<Side>& sides, const std::vector<Edge>& between, SignedForest& trees) const;
  std::uint32_t nextSheet(std::uint32_t i, Neighbors& around) const;
  bool isNoted(std::uint32_t a, std::uint32_t b, SignedForest& trees) const;

  const PointSet& points_;
  const std::vector<Eigen::Vector3f>& normals_;
  const NeighborSearch& search_;
  const Reach& reach_;
  std::vector<Edge> between_;
};

} // namespace pcl::mrf
