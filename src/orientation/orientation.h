// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Connected components of a point set and consistent orientation of its normals (paper Sec. 3.1).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

/// The option, or its automatic value, cloud's unit; of local distances the median.
float resolvedNeighborDistance(const OrientationOptions& options, const SamplingDensity& density);

struct OrientationResult : OrientationSummary {
  std::vector<Eigen::Vector3f> normals; ///< consistently oriented, unit; one per point
  std::vector<std::uint8_t> keep;       ///< 0 for points of small components

  const OrientationSummary& summary() const { return *this; }
};

/// Makes normals consistent inside each connected component and decides the sign of each component by a vote.
///
/// Edges join points closer than the neighbor distance (the 12 nearest, and what connectivity needs besides). They are
/// taken best first, and the component's tree fixes the relative signs. An edge is the better, the more parallel the
/// two normals are up to sign after reflection at the edge's bisector plane, which is exact on circular arcs, and the
/// less the edge leaves the tangent planes: edges along the normals lead to the opposite sheet of a thin object.
///
///       b ↑   ↗ n_b        b ←·   n_b        b ↓  n_b
///        \__·               |                  |
///      n_a ↑ a             a ·↑ n_a          a ·↑ n_a
///        good            crease: late       two sheets: last
///
/// Differences to the paper: creases stop its search for good, here they only come late (joinAcrossCreases); edges
/// along both normals join nothing unless the vote is outward, so that two sheets vote on their own; and where the view
/// of each point, or a reference, is known, a piece of smooth surface (joined by good edges alone) whose own vote is
/// decisive, three quarters or more, is not outvoted by the component it belongs to.
///
/// Where views are known, a normal that looks away from its sensor by more than 4° is turned on its own; and a point
/// whose piece of smooth surface has fewer than 50 is turned as its own view, or reference, says.
///
/// The outward vote is right for components that enclose a volume; those inside an odd number of others are the walls
/// of cavities, and are turned inward. A component is open if |Σ A n|, which its border alone decides, exceeds .18
/// Σ A; holes of up to 22 % of an object's diagonal do not reach that. Open components that form one height field, as
/// what one scanner sees does, are all turned to one side of it: to where the points lie closer in depth, as they do
/// near a scanner, or else outward if that is decisive, or else to the positive side of its axis. All of that is a
/// guess. Components of under 50 points follow the nearest larger one where it is close.
///
/// Without a vote no sign is changed, and the components are those of all edges up to the neighbor distance.
///
/// Opposite sheets closer than about twice l̄ cannot be told apart by their points; agreement is then low unless
/// views or reference normals are given.
/// \param normals unit length, one per point, as estimated or as they came; a zero normal joins nothing and is dropped
/// \param vote OrientationVote::sensor needs points.sensors, reference needs points.normals
/// \throw InvalidOption as validate does; InvalidInput if what the vote needs is missing
/// Cost: one 13-neighbor query per point, and sorting about 7 edges per point; without a vote one 5-neighbor query.
/// The result does not depend on the number of threads or, up to ties, on the order of the points.
OrientationResult orientNormals(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                                const NeighborSearch& search, const SamplingDensity& density, OrientationVote vote,
                                const OrientationOptions& options, Execution& execution);

} // namespace mrf
} // namespace pcl
