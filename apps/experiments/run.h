// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Runs the experiments that are asked for and writes their results.
#pragma once

#include "command_line.h"

namespace mrf_apps {

/// \throw FileError, UsageError, pcl::mrf::Error
void run(const ExperimentsCommand& command);

} // namespace mrf_apps
