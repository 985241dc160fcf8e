// SPDX-License-Identifier: BSD-3-Clause
/// How much room the field needs: openings want the volume's border far away, closed surfaces do not (ours).
///
/// The border bends whatever surface comes near it; the paper's rotation error (Fig. 9) is that border. What counts is
/// the distance from the middle of a filled opening to the border, beside the size of the opening.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>

namespace pcl::mrf {

/// The box that the field is to cover, before padding: that of the points, extended beside openings.
///
/// A solution on a grid of about 20 voxels along the points' longest side, in a volume with half of that side around
/// it, shows where the surface goes on without data. Around each of its vertices in an opening that is to be filled, a
/// ball of 1.2 times the distance to the nearest point shall lie in the box, which stays in that volume. An opening is
/// what is bounded by data all around and no larger than the limit; of the rest, the sheet around an open surface, it
/// is what lies amid data, as holes that a neck joins to the sheet and bays do. Other rims get a strip of two such
/// voxels, at most 20 of the finest level. How the points lie in their box does not matter, nor does how flat they are;
/// openings of what is too thin for that grid get no room but the strip.
/// \param search holds points.positions \param spacing l̄, cloud's unit \param options with the voxel size set
/// \param maxHole diameter of the largest hole that is to be filled, cloud's unit; infinite: all
/// Cost: that of a grid of some 60,000 voxels.
BoundingBox chooseVolume(const OrientedPoints& points, const NeighborSearch& search, float spacing,
                         const Options& options, float maxHole, Execution& execution);

} // namespace pcl::mrf
