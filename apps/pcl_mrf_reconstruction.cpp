/// \file
/// \brief pcl_mrf_reconstruction: a surface mesh from a file of points.

#include "reconstruction/command_line.h"
#include "reconstruction/run.h"
#include "support/errors.h"
#include "support/tool_main.h"

#include <pcl/surface/mrf/exceptions.h>

#include <cstdio>

int main(int argc, char** argv)
{
  return mrf_apps::toolMain("pcl_mrf_reconstruction", "choose a larger --voxel-size", [&] {
    const mrf_apps::Command command = mrf_apps::parseCommandLine(argc, argv);
    if (!command.information.empty()) {
      std::fputs(command.information.c_str(), stdout);
      return;
    }
    try {
      mrf_apps::run(command);
    } catch (const pcl::mrf::InvalidInput& error) {
      throw mrf_apps::FileError(command.input, error.message());
    }
  });
}
