// SPDX-License-Identifier: BSD-3-Clause
/// Sampling density of a point set (paper Sec. 3.1): the length from which every automatic length is derived.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <vector>

namespace pcl::mrf {

/// Number of nearest other points per point in NeighborDistances.
constexpr int measuredNeighbors = 8;

/// Mean nearest distance of random points of density ρ, .5/√ρ, as a share of the distance to the 8th neighbor.
constexpr float nearestToEighth = .323f;

/// Distances from each point to its nearest other points, cloud's unit; one entry per point.
struct NeighborDistances {
  std::vector<float> nearest; ///< to the closest other point, infinite without one
  std::vector<float> eighth;  ///< to the 8th other point, infinite without one
  std::vector<float> mean;    ///< mean over the 8 nearest others, or as many as there are; 0 without one
  bool hasCoincident = false; ///< some positions are equal
};

/// \param search holds exactly points.positions
/// Cost: one 9-neighbor query per point.
NeighborDistances measureNeighbors(const PointSet& points, const NeighborSearch& search, Execution& execution);

/// Local sampling distances: .323 times the distance to the 8th neighbor, averaged over points that are close by both
/// in memory and in space. \return one per point, cloud's unit; empty for fewer than nine points
std::vector<float> localSpacings(const PointSet& points, const NeighborDistances& distances, Execution& execution);

/// Estimates the sampling density: .323 times the median distance to the 8th neighbor (not in the paper), because the
/// mean nearest distance depends on pairs of close points. For fewer than nine points it is the mean nearest distance.
/// \param points at least 2 distinct positions; coincident ones count once: they are measured again without duplicates
/// \throw InvalidInput if fewer than two positions are distinct
/// The result does not depend on the number of threads.
SamplingDensity estimateSamplingDensity(const PointSet& points, const NeighborDistances& distances,
                                        Execution& execution, LengthUnit unit = LengthUnit::density);

/// The power of the distance with which the number of neighbors grows: about 1 on a curve, 2 on a surface, 3 in a
/// volume. It is measured over a factor of 8 in that number, as the median of 64 points.
/// \param search holds exactly positions \return the power; 2 for fewer than 1024 points, which are too few to tell
double growthOfNeighbors(const std::vector<Eigen::Vector3f>& positions, const NeighborSearch& search,
                         Execution& execution);

} // namespace pcl::mrf
