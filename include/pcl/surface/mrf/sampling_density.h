/// \file
/// \brief Sampling density of a point set (paper Sec. 3.1): the length every automatic length is derived from.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbour_search.h>
#include <pcl/surface/mrf/point_set.h>

#include <vector>

namespace pcl {
namespace mrf {

/// Lengths in the cloud's unit.
struct SamplingDensity {
  float spacing = 0;          ///< l̄: max(nearestMean, 0.313 · eighthMedian); what the other stages call l̄
  float nearestMean = 0;      ///< mean distance to the closest other point (the paper's l̄)
  float nearestDeviation = 0; ///< standard deviation of that distance, σ_l
  float eighthMedian = 0;     ///< median distance to the 8th neighbour; 0 with fewer than 9 distinct points
};

/// Nearest others of each point that NeighbourDistances tell of.
constexpr int measuredNeighbours = 8;

/// On a randomly sampled surface the mean nearest distance is this share of the distance to the 8th neighbour.
constexpr float nearestToEighth = .313f;

/// Distances from each point to its nearest others, cloud's unit: what the sampling density and the outlier filter are
/// made of. One entry per point.
struct NeighbourDistances {
  std::vector<float> nearest; ///< to the closest other point, infinite without one
  std::vector<float> eighth;  ///< to the 8th other point, infinite without one
  std::vector<float> mean;    ///< mean over the 8 nearest others, or as many as there are; 0 without one
  bool hasCoincident = false; ///< some positions are equal
};

/// \param search holds exactly points.positions
/// Cost: one 9-neighbour query per point.
NeighbourDistances measureNeighbours(const PointSet& points, const NeighbourSearch& search, Execution& execution);

/// Local sampling distances: .313 times the distance to the 8th neighbour, the mean nearest distance of random points of
/// that density. Range data thin out with distance and angle, by factors of five in one Kinect frame.
/// \return one per point; empty if there are too few points to tell
std::vector<float> localSpacings(const NeighbourDistances& distances);

/// Estimates the sampling density.
///
/// Overlapping scans make the mean nearest distance misleadingly small; on a uniformly sampled surface the 8th
/// neighbour is l̄/0.313 away, hence the maximum of the two (not in the paper).
/// \param points at least 2 distinct positions; coincident ones count once
/// \param search holds exactly points.positions
/// \throw InvalidInput if fewer than two positions are distinct
/// Cost: one 9-neighbour query per point. The result does not depend on the number of threads.
SamplingDensity estimateSamplingDensity(const PointSet& points, const NeighbourSearch& search, Execution& execution);

/// The same from distances that have been measured. Coincident points are measured again without their duplicates.
SamplingDensity estimateSamplingDensity(const PointSet& points, const NeighbourDistances& distances,
                                        Execution& execution);

} // namespace mrf
} // namespace pcl
