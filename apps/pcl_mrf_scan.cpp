// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief pcl_mrf_scan: simulated range scans.

#include "scan/command_line.h"
#include "scan/run.h"
#include "support/tool_main.h"

int main(int argc, char** argv)
{
  return mrf_apps::toolMain("pcl_mrf_scan", "ask for fewer --points", [&] {
    return mrf_apps::runOrTell(mrf_apps::parseScanCommandLine(argc, argv), mrf_apps::run);
  });
}
