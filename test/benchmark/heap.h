// SPDX-License-Identifier: BSD-3-Clause
/// What a stage takes from the heap.
#pragma once

#include <cstdint>

namespace benchmarks {

/// Bytes that the heap has given and not got back, of all threads; 0 under sanitizers, where nothing is counted.
std::int64_t heapBytes();

/// The largest heapBytes() since the last call of resetPeak.
std::int64_t peakBytes();
void resetPeak();

} // namespace benchmarks
