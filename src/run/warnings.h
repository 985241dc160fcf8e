// SPDX-License-Identifier: BSD-3-Clause
/// Warnings about a cloud or its options that do not make a run fail.
#pragma once

#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <vector>

namespace pcl::mrf {

/// Warns if the points fill a volume, or lie on lines or in one plane. \param growth see growthOfNeighbors
void warnOfNoSurface(const PointSet& points, double growth, Report& report);

/// Names each rule that dropped more than 2 % of the points.
void warnOfDroppedPoints(Report& report);

/// Names the options that were changed from their defaults but have no effect on this kind of observation.
void warnOfUnusedOptions(const Options& options, Report& report);

/// Warns if confidences are above 1, which count as 1.
void warnOfConfidences(const std::vector<float>& confidences, Report& report);

/// Warns if the coordinates are rounded too coarsely for the voxels. \param resolution rounding step, cloud's unit
void warnOfCoarseInput(double resolution, double voxelSize, Report& report);

/// Names the coarsest level that stopped before it converged, because finer levels build on it. A band that is followed
/// by another band does not count: the next one completes it near the points.
void warnOfUnsolvedLevels(Report& report);

/// Warns if the number of triangles differs from the requested one by more than 2 %.
void warnOfTriangles(Report& report);

/// Warns how much of the surface maxError dropped. \pre report.mesh still describes the mesh before
void warnOfUncertainSurface(Report& report);

} // namespace pcl::mrf
