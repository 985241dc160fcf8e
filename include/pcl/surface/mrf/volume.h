/// \file
/// \brief How much room the field needs: openings want the volume's border far away, closed surfaces do not (ours).
///
/// The border bends whatever surface comes near it; the paper's rotation error (Fig. 9) is that border. What counts is
/// the distance from the middle of a filled opening to the border, beside the size of the opening.
#pragma once

#include <pcl/surface/mrf/multiscale.h>

namespace pcl {
namespace mrf {

/// The box that the field is to cover, before padding: that of the points, extended beside openings.
///
/// A solution on a grid of about 20 voxels along the points' longest side, in a volume with half of that side around
/// it, shows where the surface goes on without data. Around each of its vertices a ball of 1.2 times the distance to
/// the nearest point shall lie in the box, which grows by at most half of its shortest side each way. \param search
/// holds points.positions \param spacing l̄, cloud's unit \param multiscale with the voxel size set Cost: that of a grid
/// of some 60,000 voxels.
BoundingBox chooseVolume(const OrientedPoints& points, const NeighbourSearch& search, float spacing,
                         const ObservationOptions& observation, const PriorOptions& prior, const SolverOptions& solver,
                         const MultiscaleOptions& multiscale, Execution& execution);

} // namespace mrf
} // namespace pcl
