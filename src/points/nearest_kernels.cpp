// SPDX-License-Identifier: BSD-3-Clause
#include "points/nearest_kernels.h"

#include "base/multiversioning.h"

#include <cstring>
#include <limits>

namespace pcl::mrf::kernels {
namespace {

using Lanes4 = float __attribute__((vector_size(16)));
using Lanes8 = float __attribute__((vector_size(32)));
using Lanes16 = float __attribute__((vector_size(64)));

/// Keeps k sorted values per lane. A new value sinks to its place by minimum and maximum, without a branch.
///
/// The vectors are as wide as those of the instruction set. Without vector types the compiler does not keep the sorted
/// values in registers, and it splits vectors that are too wide into single values.
template <typename Lanes, std::size_t k>
MRF_ALWAYS_INLINE void nearestBody(std::size_t count, Coordinates candidates, Coordinates queries, float* result)
{
  for (std::size_t lane = 0; lane < queryLanes; lane += sizeof(Lanes) / sizeof(float)) {
    Lanes qx, qy, qz, best[k];
    std::memcpy(&qx, queries.x + lane, sizeof qx);
    std::memcpy(&qy, queries.y + lane, sizeof qy);
    std::memcpy(&qz, queries.z + lane, sizeof qz);
    for (Lanes& lanes : best)
      lanes = Lanes{} + std::numeric_limits<float>::infinity();
    for (std::size_t c = 0; c < count; ++c) {
      const Lanes dx = qx - candidates.x[c], dy = qy - candidates.y[c], dz = qz - candidates.z[c];
      Lanes sinking = dx * dx + dy * dy + dz * dz;
#pragma GCC unroll 13
      for (std::size_t n = 0; n < k; ++n) {
        const Lanes value = best[n];
        best[n] = sinking < value ? sinking : value;
        sinking = sinking < value ? value : sinking;
      }
    }
    for (std::size_t n = 0; n < k; ++n)
      std::memcpy(result + n * queryLanes + lane, &best[n], sizeof best[n]);
  }
}

#ifdef MRF_HAS_MULTIVERSIONING
template <std::size_t k>
__attribute__((target("avx512f"))) void nearestAvx512(std::size_t count, Coordinates candidates, Coordinates queries,
                                                      float* result)
{
  nearestBody<Lanes16, k>(count, candidates, queries, result);
}

template <std::size_t k>
__attribute__((target("avx2"))) void nearestAvx2(std::size_t count, Coordinates candidates, Coordinates queries,
                                                 float* result)
{
  nearestBody<Lanes8, k>(count, candidates, queries, result);
}
#endif

template <std::size_t k>
void nearest(std::size_t count, Coordinates candidates, Coordinates queries, float* result)
{
#ifdef MRF_HAS_MULTIVERSIONING
  if (instructionSet == InstructionSet::avx512)
    return nearestAvx512<k>(count, candidates, queries, result);
  if (instructionSet == InstructionSet::avx2)
    return nearestAvx2<k>(count, candidates, queries, result);
#endif
  nearestBody<Lanes4, k>(count, candidates, queries, result);
}

} // namespace

void nearestDistances(std::size_t count, Coordinates candidates, Coordinates queries, std::size_t k, float* result)
{
  static_assert(maxNearest == 13, "the largest kernel");
  float all[maxNearest * queryLanes];
  if (k <= 5)
    nearest<5>(count, candidates, queries, all);
  else if (k <= 9)
    nearest<9>(count, candidates, queries, all);
  else
    nearest<13>(count, candidates, queries, all);
  for (std::size_t n = 0; n < k * queryLanes; ++n)
    result[n] = all[n];
}

MRF_MULTIVERSION(void, distances,
                 (std::size_t count, Coordinates candidates, const float* query, float* __restrict result),
                 (count, candidates, query, result))
{
  const float x = query[0], y = query[1], z = query[2];
  for (std::size_t c = 0; c < count; ++c) {
    const float dx = x - candidates.x[c], dy = y - candidates.y[c], dz = z - candidates.z[c];
    result[c] = dx * dx + dy * dy + dz * dz;
  }
}

} // namespace pcl::mrf::kernels
