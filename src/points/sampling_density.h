// SPDX-License-Identifier: BSD-3-Clause
/// Sampling density of a point set (paper Sec. 3.1): the length every automatic length is derived from.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <vector>

namespace pcl::mrf {

/// Nearest others of each point that NeighborDistances tell of.
constexpr int measuredNeighbors = 8;

/// The mean nearest distance of random points of density ρ, .5/√ρ, in distances to the 8th neighbor.
constexpr float nearestToEighth = .323f;

/// Distances from each point to its nearest others, cloud's unit: what the sampling density and the outlier filter are
/// made of. One entry per point.
struct NeighborDistances {
  std::vector<float> nearest; ///< to the closest other point, infinite without one
  std::vector<float> eighth;  ///< to the 8th other point, infinite without one
  std::vector<float> mean;    ///< mean over the 8 nearest others, or as many as there are; 0 without one
  bool hasCoincident = false; ///< some positions are equal
};

/// \param search holds exactly points.positions
/// Cost: one 9-neighbor query per point.
NeighborDistances measureNeighbors(const PointSet& points, const NeighborSearch& search, Execution& execution);

/// Local sampling distances: .323 times the distance to the 8th neighbor, averaged over what lies close by in memory as
/// well as in space. \return one per point, cloud's unit; empty if there are too few points to tell
std::vector<float> localSpacings(const PointSet& points, const NeighborDistances& distances, Execution& execution);

/// Estimates the sampling density: .323 times the median distance to the 8th neighbor, which tells of density where the
/// mean nearest distance tells of pairs (not in the paper); fewer than nine points have their mean nearest distance.
/// \param points at least 2 distinct positions; coincident ones count once \param search holds exactly points.positions
/// \throw InvalidInput if fewer than two positions are distinct
/// Cost: one 9-neighbor query per point. The result does not depend on the number of threads.
SamplingDensity estimateSamplingDensity(const PointSet& points, const NeighborSearch& search, Execution& execution,
                                        LengthUnit unit = LengthUnit::density);

/// The same from distances that have been measured. Coincident points are measured again without their duplicates.
SamplingDensity estimateSamplingDensity(const PointSet& points, const NeighborDistances& distances,
                                        Execution& execution, LengthUnit unit = LengthUnit::density);

/// The power with which the number of neighbors grows with their distance, over a factor of 8 in that number, at the
/// median of some dozen points: about 2 on a surface, 3 in a volume, 1 on a curve.
/// \return 2 of fewer than 1024 points, which do not tell \param search holds exactly positions
double growthOfNeighbors(const std::vector<Eigen::Vector3f>& positions, const NeighborSearch& search,
                         Execution& execution);

} // namespace pcl::mrf
