// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Distances from a few queries to many candidates at once.
#pragma once

#include <cstddef>

namespace pcl {
namespace mrf {
namespace kernels {

/// Queries that are answered together: the lanes of the widest vectors.
constexpr std::size_t queryLanes = 16;

/// The most neighbors that nearestDistances finds.
constexpr std::size_t maxNearest = 13;

/// Squared distances to the k nearest of the candidates, ascending; infinite where there are fewer.
/// \param x, y, z of queryLanes queries \param cx, cy, cz of `count` candidates \param k 1..maxNearest
/// \param result of query q's n-th neighbor at n·queryLanes + q
void nearestDistances(std::size_t count, const float* cx, const float* cy, const float* cz, const float* x,
                      const float* y, const float* z, std::size_t k, float* result);

/// Squared distances from one query to the candidates.
void distances(std::size_t count, const float* cx, const float* cy, const float* cz, float x, float y, float z,
               float* __restrict result);

} // namespace kernels
} // namespace mrf
} // namespace pcl
