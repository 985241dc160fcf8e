// SPDX-License-Identifier: BSD-3-Clause
/// The command line of pcl_mrf_scan.
#pragma once

#include "scan.h"

#include <string>

namespace mrf_apps {

/// The options of the tool. Empty paths were not given.
struct ScanCommand {
  std::string input; ///< mesh file or description of a shape
  std::string output;
  std::string views, sensors, heldOut, clean, truth, report;
  std::string sensorsFile; ///< sensors to use
  bool hasNormals = true;
  pcl::mrf::scan::ScanOptions options;
  int threads = 0;
  bool quiet = false;
};

/// Parses and checks everything that can be checked without opening a file. \throw UsageError, Information
ScanCommand parseScanCommandLine(int argc, const char* const* argv);

} // namespace mrf_apps
