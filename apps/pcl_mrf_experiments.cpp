// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief pcl_mrf_experiments: the paper's experiments beside other methods, as a page, tables and pictures.

#include "experiments/command_line.h"
#include "experiments/run.h"
#include "support/errors.h"
#include "support/tool_main.h"

#include <cstdio>

int main(int argc, char** argv)
{
  return mrf_apps::toolMain("pcl_mrf_experiments", "", [&] {
    const mrf_apps::ExperimentsCommand command = mrf_apps::parseExperimentsCommandLine(argc, argv);
    if (command.information.empty())
      mrf_apps::run(command);
    else
      std::fputs(command.information.c_str(), stdout);
    return mrf_apps::exitDone;
  });
}
