// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief pcl_mrf_reconstruction: a surface mesh from a file of points.

#include "reconstruction/command_line.h"
#include "reconstruction/run.h"
#include "support/errors.h"
#include "support/tool_main.h"

#include <cstdio>

int main(int argc, char** argv)
{
  return mrf_apps::toolMain(mrf_apps::toolName, mrf_apps::memoryAdvice, [&]() -> int {
    const mrf_apps::Command command = mrf_apps::parseCommandLine(argc, argv);
    if (command.information.empty())
      return mrf_apps::run(command);
    std::fputs(command.information.c_str(), stdout);
    return mrf_apps::exitDone;
  });
}
