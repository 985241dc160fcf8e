// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief pcl_mrf_reconstruction: a surface mesh from a file of points.

#include "reconstruction/command_line.h"
#include "reconstruction/run.h"
#include "support/tool_main.h"

int main(int argc, char** argv)
{
  return mrf_apps::toolMain(mrf_apps::toolName, mrf_apps::memoryAdvice,
                            [&] { return mrf_apps::runOrTell(mrf_apps::parseCommandLine(argc, argv), mrf_apps::run); });
}
