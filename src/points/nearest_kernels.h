// SPDX-License-Identifier: BSD-3-Clause
/// Distances from a few queries to many candidates at once.
#pragma once

#include <cstddef>

namespace pcl::mrf::kernels {

/// Queries that are answered together: the lanes of the widest vectors.
constexpr std::size_t queryLanes = 16;

/// The most neighbors that nearestDistances finds.
constexpr std::size_t maxNearest = 13;

/// Coordinates of points, each apart.
struct Coordinates {
  const float *x, *y, *z;
};

/// Squared distances to the k nearest of the candidates, ascending; infinite where there are fewer.
/// \param count of the candidates \param queries queryLanes of them \param k 1..maxNearest
/// \param result of query q's n-th neighbor at n·queryLanes + q
void nearestDistances(std::size_t count, Coordinates candidates, Coordinates queries, std::size_t k, float* result);

/// Squared distances from one query, at three numbers, to the candidates.
void distances(std::size_t count, Coordinates candidates, const float* query, float* __restrict result);

} // namespace pcl::mrf::kernels
