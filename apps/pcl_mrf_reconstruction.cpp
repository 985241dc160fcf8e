/// \file
/// \brief pcl_mrf_reconstruction: a surface mesh from a file of points.

#include "reconstruction/command_line.h"
#include "reconstruction/run.h"
#include "support/errors.h"

#include <pcl/console/print.h>
#include <pcl/surface/mrf/exceptions.h>

#include <cstdio>
#include <new>
#include <string>

namespace {

int fail(int status, const std::string& message)
{
  std::fprintf(stderr, "pcl_mrf_reconstruction: %s\n", message.c_str());
  return status;
}

int statusOf(const pcl::mrf::Error& error)
{
  switch (error.status()) {
  case pcl::mrf::Status::invalidInput:
    return mrf_apps::exitFile;
  case pcl::mrf::Status::invalidOption:
    return mrf_apps::exitUsage;
  default:
    return mrf_apps::exitMethod;
  }
}

} // namespace

int main(int argc, char** argv)
{
  // The class logs its errors as well; once is enough.
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  std::string input;
  try {
    const mrf_apps::Command command = mrf_apps::parseCommandLine(argc, argv);
    if (!command.information.empty()) {
      std::fputs(command.information.c_str(), stdout);
      return mrf_apps::exitDone;
    }
    input = command.input;
    mrf_apps::run(command);
    return mrf_apps::exitDone;
  } catch (const mrf_apps::UsageError& error) {
    return fail(mrf_apps::exitUsage, std::string(error.what()) + " (see --help)");
  } catch (const mrf_apps::FileError& error) {
    return fail(mrf_apps::exitFile, error.what());
  } catch (const pcl::mrf::Error& error) {
    const int status = statusOf(error);
    const std::string where = status == mrf_apps::exitFile ? "'" + input + "': " : "";
    return fail(status, where + error.message() + (status == mrf_apps::exitUsage ? " (see --help)" : ""));
  } catch (const std::bad_alloc&) {
    return fail(mrf_apps::exitMethod, "out of memory; choose a larger --voxel-size");
  } catch (const std::exception& error) {
    return fail(mrf_apps::exitMethod, error.what());
  }
}
