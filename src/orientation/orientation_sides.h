// SPDX-License-Identifier: BSD-3-Clause
/// Which side of a surface is its outside, when nobody says so.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include "orientation/orientation_graph.h"

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// |Σ A n| / Σ A above which a component is open. Objects with holes
/// of 15 % of their diagonal stay below .08, of 22 % below .17; half a sphere has .5, a room without a ceiling .2.
constexpr double openFrom = .18;

/// Which components of consistent normals are to be turned.
struct Sides {
  std::vector<std::uint8_t> isTurned; ///< one flag per component
  double openShare = 0;               ///< of the surface, in components that enclose no volume
  bool isGuess = false;               ///< more than a twentieth of the surface is open
};

/// What the points of each component say on their own.
struct OutwardVotes {
  const std::vector<Eigen::Vector3f>& normals; ///< consistent inside each component
  const std::vector<float>& areas;             ///< that the points stand for, up to one common factor
  const Partition& components;
  const std::vector<std::uint8_t>& isTurned; ///< per component: whether its own outward vote turns it
};

/// Chooses as OrientationVote::outward says.
Sides chooseSides(const PointSet& points, const OutwardVotes& votes, const Reach& reach, const NeighborSearch& search,
                  Execution& execution);

} // namespace pcl::mrf
