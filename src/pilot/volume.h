// SPDX-License-Identifier: BSD-3-Clause
/// Chooses how much room the field needs: openings need the volume's border far away, closed surfaces do not (ours).
/// The border bends any surface that comes near it; it causes the paper's rotation error (Fig. 9).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>

namespace pcl::mrf {

/// The box that the field is to cover, before padding: that of the points, extended beside openings.
///
/// A coarse solution, with about 20 voxels along the points' longest side and half of that side of room around them,
/// shows where the surface goes on without data. The box contains, around each of its vertices in an opening that is to
/// be filled, a ball with 1.2 times the distance to the nearest point as radius; it stays within the coarse volume.
/// Openings are regions bounded by data all around and no larger than maxHole. In the sheet around an open surface,
/// bays, and holes that a neck joins to the sheet, are openings as well: they lie amid data. Other rims get a strip of
/// two coarse voxels, at most 20 of the finest level. Openings in parts too thin for the coarse grid get only the
/// strip. The result does not depend on how the points lie in their box, or on how flat they are.
/// \param search holds points.positions \param spacing l̄, cloud's unit \param options with the voxel size set
/// \param maxHole diameter of the largest hole to be filled, cloud's unit; infinite: all are filled
/// Cost: that of a grid of some 60,000 voxels.
BoundingBox chooseVolume(const OrientedPoints& points, const NeighborSearch& search, float spacing,
                         const Options& options, float maxHole, Execution& execution);

} // namespace pcl::mrf
