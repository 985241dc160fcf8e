// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief pcl_mrf_scan from files to files.
#pragma once

#include "command_line.h"

namespace mrf_apps {

/// Reads, scans, writes all outputs or none, and prints a summary.
/// \return exitDone \throw FileError, UsageError, pcl::mrf::Error
int run(const ScanCommand& command);

} // namespace mrf_apps
