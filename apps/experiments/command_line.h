// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The command line of pcl_mrf_experiments.
#pragma once

#include "experiment.h"

#include <string>
#include <vector>

namespace mrf_apps {

/// What the user asks for.
struct ExperimentsCommand {
  ExperimentOptions options;
  std::vector<std::string> only; ///< ids; empty: all
  int threads = 0;
  bool fresh = false;      ///< forget what earlier runs measured
  bool quiet = false;      ///< print errors only
  std::string information; ///< text of --help, --version or --list; if set, the rest is not
};

/// Parses and checks everything that can be checked without opening a file. \throw UsageError
ExperimentsCommand parseExperimentsCommandLine(int argc, const char* const* argv);

} // namespace mrf_apps
