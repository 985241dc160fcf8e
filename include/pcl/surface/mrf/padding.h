/// \file
/// \brief How much room the volume needs around the points: an open surface wants more than a closed one (ours).
///
/// The volume's border bends whatever surface comes near it; the paper's rotation error (Fig. 9) is that border. A
/// closed object does not care. An opening does, as far as it is wide: measured on a sphere of radius 40 voxel sides
/// without a cap, 10 voxels more or less are the difference between an error of 1 and of 0.2.
#pragma once

#include <pcl/surface/mrf/multiscale.h>

namespace pcl {
namespace mrf {

/// Chooses MultiscaleOptions::padding by a solution on a grid of about 40 voxels along the longest side, in a volume
/// with half of that side around the points: leastPadding, or if the surface that the data support leaves their
/// bounding box there, half of the box's shortest side more. \param search holds points.positions \param spacing l̄,
/// cloud's unit \param multiscale with the voxel size set Cost: that of a grid of some 60,000 voxels.
int choosePadding(const OrientedPoints& points, const NeighbourSearch& search, float spacing,
                  const ObservationOptions& observation, const PriorOptions& prior, const SolverOptions& solver,
                  const MultiscaleOptions& multiscale, Execution& execution);

} // namespace mrf
} // namespace pcl
