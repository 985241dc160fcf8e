// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Rays of scanners and cameras, in a regular grid from each sensor, each of which ends at the first surface.
#pragma once

#include "sampling.h"

namespace pcl::mrf::scan {

/// Points where the rays of each sensor first meet the surface, as a depth camera or a lidar measures them: their
/// density falls with the square of the distance and with the angle of incidence.
///
/// Rays are spaced regularly in azimuth and elevation about the sensor's axis, with SamplingOptions::aspect times the
/// horizontal step between the rows. A sensor inside the sphere around the object's box is level and turns once around;
/// one outside looks at the middle of the box. Those of a camera are spaced regularly in the plane of its image, which
/// looks where a scanner would; a camera inside looks straight forward. All sensors have the same steps, which are
/// chosen so that about SamplingOptions::points rays meet the surface: within a few per cent, as rows come and go
/// whole. \param seed shifts the grid of each sensor by a part of a step \throw InvalidInput if next to no ray meets
/// the surface Cost: some ten rays per point. The result does not depend on the number of threads.
Points scanWithRays(const Surface& surface, const std::vector<Eigen::Vector3d>& sensors, const SamplingOptions& options,
                    std::uint64_t seed, Execution& execution);

/// Where a scanner or camera looks: forward, left and up as columns.
Eigen::Matrix3d viewingFrame(const Eigen::Vector3d& sensor, const Box& object, const SamplingOptions& options);

} // namespace pcl::mrf::scan
