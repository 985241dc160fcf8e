// SPDX-License-Identifier: BSD-3-Clause
/// Finds the relative signs of the large trees of a graph from sheets that lie behind each other (ours).
#pragma once

#include "orientation/orientation_graph.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Joins the sides last, trees of at least a tenth of the points: those whose sheets lie behind each other so that they
/// face apart, a side that bulges and what lies outside of it so that they face each other, the rest by the best edges.
class FacingSides {
public:
  FacingSides(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, const NeighborSearch& search,
              const Reach& reach)
      : points_(points), normals_(normals), search_(search), reach_(reach)
  {}

  /// Whether an edge is between two sides. Of each pair of sides the first such edge, the best one, is noted.
  bool isBetween(const Edge& edge, SignedForest& trees);

  /// Joins the sides. \param areas area that each point stands for, up to a common factor
  /// Cost: some thousand queries, if there are several sides.
  void join(const OrientationGraph& graph, const std::vector<float>& areas, SignedForest& trees) const;

private:
  /// What the sheets of two sides show about their relative sign.
  struct Facing {
    std::uint32_t a, b;                ///< roots
    std::array<double, 2> votes{0, 0}; ///< for equal signs, for opposite signs
    double asked = 0;                  ///< number of points asked

    bool isOpposite() const { return votes[1] > votes[0]; }
    double share() const { return std::max(votes[0], votes[1]) / std::max(1., asked); }
    /// Four in five votes agree, and these are at least the share ofAsked of the points asked.
    bool isDecisive(double ofAsked) const;
  };
  struct Side {
    std::uint32_t root;
    std::vector<std::uint32_t> points;
    bool isOpen = false; ///< it encloses no volume
    int outward = 0;     ///< sign with which its normals face outward; 0 if it hardly bulges
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
