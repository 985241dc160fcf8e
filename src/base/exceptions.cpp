// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/exceptions.h>

namespace pcl::mrf {

const char* toString(Status status)
{
  switch (status) {
  case Status::notRun:
    return "not run";
  case Status::ok:
    return "ok";
  case Status::invalidInput:
    return "invalid input";
  case Status::invalidOption:
    return "invalid option";
  case Status::resourceLimit:
    return "resource limit";
  case Status::solverFailure:
    return "solver failure";
  case Status::cancelled:
    return "cancelled";
  case Status::callerError:
    return "error of the caller";
  case Status::internalError:
    return "internal error";
  }
  return "unknown";
}

void throwCallerError(const char* what)
{
  std::string text = "an exception of an unknown type";
  try {
    throw;
  } catch (const std::exception& error) {
    text = error.what();
  } catch (...) {
  }
  throw CallerError(std::string(what) + " failed: " + text);
}

} // namespace pcl::mrf
