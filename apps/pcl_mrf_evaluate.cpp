// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief pcl_mrf_evaluate: how good a reconstructed mesh is.

#include "evaluate/command_line.h"
#include "evaluate/run.h"
#include "support/tool_main.h"

int main(int argc, char** argv)
{
  return mrf_apps::toolMain("pcl_mrf_evaluate", "", [&] {
    return mrf_apps::runOrTell(mrf_apps::parseEvaluateCommandLine(argc, argv), mrf_apps::run);
  });
}
