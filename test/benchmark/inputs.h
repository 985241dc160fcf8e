// SPDX-License-Identifier: BSD-3-Clause
/// Inputs of the benchmarks, and the counters that all of them report.
#pragma once

#include "heap.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>

namespace benchmarks {

/// Points evenly spread over the unit sphere (a Fibonacci spiral), in random order, with exact normals.
pcl::mrf::PointSet spherePoints(std::int64_t count);

/// They, with their search and what the library finds their density to be.
struct Cloud {
  pcl::mrf::PointSet points;
  std::unique_ptr<pcl::mrf::NeighborSearch> search;
  pcl::mrf::SamplingDensity density;

  explicit Cloud(std::int64_t count);
};

/// An input of this size; the last one is kept, because benchmarks of one size follow each other.
template <typename Input>
const Input& inputOf(std::int64_t size)
{
  static std::unique_ptr<Input> last;
  static std::int64_t lastSize = 0;
  if (size != lastSize) {
    last.reset();
    last = std::make_unique<Input>(size);
    lastSize = size;
  }
  return *last;
}

/// RMS distance of the vertices from the unit sphere about the origin.
double sphereError(const pcl::mrf::TriangleMesh& mesh);

/// Runs a stage for as long as the benchmark wants it, with the number of threads in its last argument, and reports the
/// items per second and what the stage took from the heap per item, its result included.
template <typename Stage>
void runStage(benchmark::State& state, std::int64_t threads, const std::string& item, double items, const Stage& stage)
{
  pcl::mrf::Execution execution(static_cast<int>(threads));
  std::int64_t bytes = 0;
  for (auto _ : state) {
    const std::int64_t before = heapBytes();
    resetPeak();
    stage(execution);
    bytes = std::max(bytes, peakBytes() - before);
  }
  state.counters[item + "s"] = benchmark::Counter(items, benchmark::Counter::kIsIterationInvariantRate);
  state.counters["bytes/" + item] = static_cast<double>(bytes) / items;
}

/// Wall-clock time decides how long to run; the processor time is that of all threads.
inline void configure(benchmark::internal::Benchmark* benchmark)
{
  benchmark->UseRealTime()->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);
}

} // namespace benchmarks
