// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The measure of the rotation experiment: how far two reconstructions of the same points are apart.
#pragma once

#include "evaluate/evaluation.h"

#include <functional>

namespace mrf_apps {

/// \param axis not zero \param angle degrees
Eigen::Matrix3d rotationAbout(const Eigen::Vector3d& axis, double angle);

/// Distances between two surfaces in a part of space, both ways: samples of each one that lie in the region, to the
/// whole other surface. All zero if neither surface meets the region; infinite if only one does.
/// \param samples on each whole surface, evenly
Statistics differenceWithin(const SurfaceMesh& a, const SurfaceMesh& b,
                            const std::function<bool(const Eigen::Vector3d&)>& isInside, std::int64_t samples,
                            std::uint64_t seed, pcl::mrf::Execution& execution);

/// Drops the triangles with a vertex farther than this from the origin. Vertices stay.
void keepWithin(double radius, SurfaceMesh& mesh);

} // namespace mrf_apps
