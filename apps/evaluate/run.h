// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The job of pcl_mrf_evaluate.
#pragma once

#include "command_line.h"

namespace mrf_apps {

/// Reads, measures, writes and prints the table. Leaves no output behind if it throws.
/// \return exitDone \throw FileError, UsageError, pcl::mrf::Error
int run(const EvaluateCommand& command);

} // namespace mrf_apps
