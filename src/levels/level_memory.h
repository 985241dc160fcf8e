// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What the levels of the multiscale scheme take, before anything of them is allocated.
#pragma once

#include <pcl/surface/mrf/multiscale.h>

namespace pcl {
namespace mrf {

/// Peak bytes of a level in a band per unknown.
double bytesPerUnknown();

/// Area that a point stands for, in squared spacings: the mean distance to the nearest of points at random.
constexpr double areaPerPoint = 4;

/// Peak bytes of solving a box with voxels of this side at the finest level, beside what is held before; infinite if it
/// has too many voxels to be counted. Parameters as for planLevels; the options' denseVoxels decide between dense
/// levels and bands.
double predictedBytes(const BoundingBox& box, double side, const Workload& workload, const MultiscaleOptions& options,
                      int threads);

} // namespace mrf
} // namespace pcl
