// SPDX-License-Identifier: BSD-3-Clause
/// What a run has to say about a cloud or its options without failing.
#pragma once

#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <vector>

namespace pcl::mrf {

/// Says so if the points fill a volume, lie on lines or in one plane. \param growth see growthOfNeighbors
void warnOfNoSurface(const PointSet& points, double growth, Report& report);

/// Names the rules that dropped more points than an everyday scan has outliers.
void warnOfDroppedPoints(Report& report);

/// Names the options that were changed although what observes the field has no use for them.
void warnOfUnusedOptions(const Options& options, Report& report);

/// Says so if confidences are above 1: they count as 1.
void warnOfConfidences(const std::vector<float>& confidences, Report& report);

/// \param resolution steps of the coordinates as they came, cloud's unit
void warnOfCoarseInput(double resolution, double voxelSize, Report& report);

/// Names the coarsest level that has stopped short of its solution: the finer ones build on it. Not a band that
/// another follows, which does near the points what this one has left.
void warnOfUnsolvedLevels(Report& report);

/// Says if the mesh has not as many triangles as were asked for.
void warnOfTriangles(Report& report);

/// Says how much of the surface went because it may be too far off. \pre the mesh's statistics are those of before
void warnOfUncertainSurface(Report& report);

} // namespace pcl::mrf
