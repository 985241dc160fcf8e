// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The job of pcl_mrf_reconstruction.
#pragma once

#include "command_line.h"

namespace mrf_apps {

constexpr const char* toolName = "pcl_mrf_reconstruction";
constexpr const char* memoryAdvice = "choose a larger --voxel-size";

/// Reads, reconstructs, writes and prints the summary, job by job. A job that fails leaves no output behind.
/// Of several jobs a failure is told on standard error, and the others are done.
/// \return the exit status of the first job that failed, of several, or 0
/// \throw FileError, UsageError, pcl::mrf::Error if the only job fails, or if nothing can be done
int run(const Command& command);

} // namespace mrf_apps
