// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Which side of a surface is its outside, when nobody says so.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include "orientation/orientation_graph.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace pcl {
namespace mrf {

/// Which components of consistent normals are to be turned.
struct Sides {
  std::vector<std::uint8_t> isTurned; ///< one flag per component
  double openShare = 0;               ///< of the surface, in components that enclose no volume
  bool isGuess = false;               ///< more than a twentieth of the surface is open
};

/// Chooses as OrientationVote::outward says.
/// \param normals consistent inside each component
/// \param areas that the points stand for, up to one common factor
/// \param isTurnedOutward per component: whether its own outward vote turns it
Sides chooseSides(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, const std::vector<float>& areas,
                  const Partition& components, const std::vector<std::uint8_t>& isTurnedOutward, const Reach& reach,
                  const NeighborSearch& search, Execution& execution);

} // namespace mrf
} // namespace pcl
