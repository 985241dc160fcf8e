// SPDX-License-Identifier: BSD-3-Clause
#include "base/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace pcl::mrf {
namespace {

constexpr std::size_t unlimited = std::numeric_limits<std::size_t>::max();

/// The number at the beginning of a file; \return `otherwise` if there is no such file, or a word in it ("max")
std::size_t numberIn(const std::string& path, std::size_t otherwise)
{
  std::size_t number = 0;
  return std::ifstream(path) >> number ? number : otherwise;
}

/// Bytes of a group that the kernel cannot drop; the group's usage would include cached files.
std::size_t residentIn(const std::string& statistics, const std::string& name)
{
  std::ifstream file(statistics);
  std::string key;
  for (std::size_t bytes = 0; file >> key >> bytes;)
    if (key == name)
      return bytes;
  return 0;
}

/// The rest of a limit.
std::size_t left(std::size_t limit, std::size_t used)
{
  return limit == unlimited ? unlimited : limit - std::min(limit, used);
}

/// The rest of the process's limit of addresses (ulimit -v).
std::size_t leftOfAddresses()
{
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
    return unlimited;
  const std::size_t pages = numberIn("/proc/self/statm", 0); // the first number is the total size
  return left(limit.rlim_cur, pages * static_cast<std::size_t>(sysconf(_SC_PAGE_SIZE)));
}

/// The smallest rest of the memory limits of the process's control group and its parents: a container, a batch job.
std::size_t leftOfGroups()
{
  const std::string root = "/sys/fs/cgroup";
  std::size_t min = unlimited;
  std::ifstream groups("/proc/self/cgroup"); // lines "number:controllers:path"; without controllers in version 2
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos)
      continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const bool isSecond = controllers.empty();
    if (!isSecond && controllers != "memory")
      continue;
    // In a container the path may be the host's, while the group itself is mounted at the root: try all parent paths.
    for (std::string path = line.substr(second + 1);; path.erase(path.find_last_of('/'))) {
      const std::string folder = root + (isSecond ? "" : "/memory") + path + "/memory.";
      min = std::min(min, left(numberIn(folder + (isSecond ? "max" : "limit_in_bytes"), unlimited),
                               residentIn(folder + "stat", isSecond ? "anon" : "total_rss")));
      if (path.find('/') == std::string::npos)
        break;
    }
  }
  return min;
}

std::size_t leftOfMachine()
{
  std::ifstream meminfo("/proc/meminfo");
  std::string key, unit;
  std::size_t kibibytes = 0;
  while (meminfo >> key >> kibibytes >> unit)
    if (key == "MemAvailable:")
      return kibibytes * 1024;
  return static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(sysconf(_SC_PAGE_SIZE));
}

} // namespace

std::size_t availableMemory()
{
  return std::min({leftOfAddresses(), leftOfGroups(), leftOfMachine()});
}

std::size_t peakMemory()
{
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

void releaseFreedMemory()
{
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

} // namespace pcl::mrf
