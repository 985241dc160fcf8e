// SPDX-License-Identifier: BSD-3-Clause
/// Chooses the outside of a surface if neither sensors nor reference normals tell it.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include "orientation/orientation_graph.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// |Σ A n| / Σ A above which a component is open. Objects with holes of 15 % of their diagonal stay below .08, of 22 %
/// below .17. Half a sphere has .5, a room without a ceiling .2.
constexpr double openFrom = .18;

/// How much points face away from their middle: 1 if all do, −1 if all face it, 0 for a flat patch. A flat patch has no
/// outside, so that its rounding and noise count little. \param forPoints calls visit(i) for each of the points
/// \param areas area that each point stands for \param normalOf returns the normal of point i with its present sign
template <typename ForPoints, typename NormalOf>
double outwardness(const std::vector<Eigen::Vector3f>& positions, const std::vector<float>& areas,
                   const ForPoints& forPoints, const NormalOf& normalOf)
{
  Eigen::Vector4d moment = Eigen::Vector4d::Zero();
  forPoints([&](std::size_t i) { moment += double{areas[i]} * positions[i].cast<double>().homogeneous(); });
  double balance = 0, total = 0;
  forPoints([&](std::size_t i) {
    const Eigen::Vector3d arm = positions[i].cast<double>() - moment.hnormalized();
    const double value = areas[i] * Eigen::Vector3f(normalOf(i)).cast<double>().dot(arm);
    balance += value;
    total += std::max(std::abs(value), .01 * areas[i] * arm.norm());
  });
  return total > 0 ? balance / total : 0;
}

/// Which components of consistent normals are to be turned.
struct Sides {
  std::vector<std::uint8_t> isTurned; ///< one flag per component
  double openShare = 0;               ///< share of the surface in components that enclose no volume
  bool isGuess = false;               ///< more than a twentieth of the surface is open
};

/// The outward votes of the components, and what they were made from.
struct OutwardVotes {
  const std::vector<Eigen::Vector3f>& normals; ///< consistent inside each component
  const std::vector<float>& areas;             ///< area that each point stands for, up to one common factor
  const Partition& components;
  const std::vector<std::uint8_t>& isTurned; ///< per component: whether its own outward vote turns it
};

/// Chooses the sides of the components as OrientationVote::outward describes.
Sides chooseSides(const PointSet& points, const OutwardVotes& votes, const Reach& reach, const NeighborSearch& search,
                  Execution& execution);

} // namespace pcl::mrf
