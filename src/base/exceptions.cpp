// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/exceptions.h>

#include <array>

namespace pcl::mrf {

const char* toString(Status status)
{
  static constexpr std::array<const char*, 9> words = {
      "not run",        "ok",        "invalid input",       "invalid option", "resource limit",
      "solver failure", "cancelled", "error of the caller", "internal error"};
  return words[static_cast<std::size_t>(status)];
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
