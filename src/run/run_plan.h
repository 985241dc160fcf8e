// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What the stages of a run are expected to take, for its progress.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/options.h>

#include <cstddef>
#include <vector>

namespace pcl::mrf {

/// The stages of reconstruct() in their order, with rough times: on two threads of an ordinary processor, of scans
/// whose surface has as many holes as most have. What they are wrong by, the progress corrects as it goes.
std::vector<ExpectedStage> expectedStages(std::size_t points, const Options& options);

} // namespace pcl::mrf
