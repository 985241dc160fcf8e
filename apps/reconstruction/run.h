/// \file
/// \brief The job of pcl_mrf_reconstruction.
#pragma once

#include "command_line.h"

namespace mrf_apps {

/// Reads, reconstructs, writes and prints the summary. Leaves no output behind if it throws.
/// \throw FileError, UsageError, pcl::mrf::Error
void run(const Command& command);

} // namespace mrf_apps
