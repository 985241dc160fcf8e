// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief pcl_mrf_scan: simulated range scans.

#include "scan/command_line.h"
#include "scan/run.h"
#include "support/errors.h"
#include "support/tool_main.h"

#include <cstdio>

int main(int argc, char** argv)
{
  return mrf_apps::toolMain("pcl_mrf_scan", "ask for fewer --points", [&] {
    const mrf_apps::ScanCommand command = mrf_apps::parseScanCommandLine(argc, argv);
    if (command.information.empty())
      mrf_apps::run(command);
    else
      std::fputs(command.information.c_str(), stdout);
    return mrf_apps::exitDone;
  });
}
