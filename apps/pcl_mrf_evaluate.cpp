// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief pcl_mrf_evaluate: how good a reconstructed mesh is.

#include "evaluate/command_line.h"
#include "evaluate/run.h"
#include "support/errors.h"
#include "support/tool_main.h"

#include <cstdio>

int main(int argc, char** argv)
{
  return mrf_apps::toolMain("pcl_mrf_evaluate", "", [&] {
    const mrf_apps::EvaluateCommand command = mrf_apps::parseEvaluateCommandLine(argc, argv);
    if (command.information.empty())
      mrf_apps::run(command);
    else
      std::fputs(command.information.c_str(), stdout);
    return mrf_apps::exitDone;
  });
}
