// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Options as functions of bytes: as the tools parse them, and as the library validates them.
#pragma once

#include <string>

namespace fuzz {

/// The lines are the words of a command line. \throw mrf_apps::UsageError
void readReconstructionCommand(const std::string& lines);
void readEvaluationCommand(const std::string& lines);
void readScanCommand(const std::string& lines);

/// Each nine bytes set a member of the default options: which one, and its bits. \throw pcl::mrf::InvalidOption
void readOptions(const std::string& bytes);

} // namespace fuzz
