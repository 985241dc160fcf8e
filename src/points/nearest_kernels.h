// SPDX-License-Identifier: BSD-3-Clause
/// Distances from a few queries to many candidates at once.
#pragma once

#include <cstddef>

namespace pcl::mrf::kernels {

/// Number of queries answered together: the lanes of the widest vectors.
constexpr std::size_t queryLanes = 16;

/// The max number of neighbors that nearestDistances finds.
constexpr std::size_t maxNearest = 13;

/// Coordinates of points, one array per axis.
struct Coordinates {
  const float *x, *y, *z;
};

/// Squared distances to the k nearest of the candidates, ascending; infinite where there are fewer.
/// \param count number of candidates \param queries queryLanes queries \param k 1..maxNearest
/// \param result the distance of query q's n-th neighbor is at n·queryLanes + q
void nearestDistances(std::size_t count, Coordinates candidates, Coordinates queries, std::size_t k, float* result);

/// Squared distances from one query, given by three coordinates, to the candidates.
void distances(std::size_t count, Coordinates candidates, const float* query, float* __restrict result);

} // namespace pcl::mrf::kernels
