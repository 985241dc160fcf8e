// SPDX-License-Identifier: BSD-3-Clause
#include "tool_main.h"

#include "errors.h"
#include "output_files.h"

#include <pcl/console/print.h>
#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/option_table.h>

#include <cstdio>
#include <new>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace mrf_apps {
namespace {

int statusOf(const pcl::mrf::Error& error)
{
  const pcl::mrf::Status status = error.status();
  return status == pcl::mrf::Status::invalidInput    ? exitFile
         : status == pcl::mrf::Status::invalidOption ? exitUsage
                                                     : exitMethod;
}

/// Keeps the memory of freed arrays for the next ones. By default large arrays go back to the system, which clears
/// every page again for the next stage: about a twentieth of the time of a large cloud.
void keepFreedMemory()
{
#ifdef __GLIBC__
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, -1);
#endif
}

} // namespace

int guarded(const std::string& name, const std::string& subject, const std::string& memoryAdvice,
            const std::function<int()>& part)
{
  const auto fail = [&](int status, const std::string& message) {
    const std::string line = escaped(message), about = escaped(subject);
    const bool isNamed = about.empty() || line.find(about) != std::string::npos;
    std::fprintf(stderr, "%s: %s%s%s\n", name.c_str(), isNamed ? "" : ("'" + about + "': ").c_str(), line.c_str(),
                 status == exitUsage ? " (see --help)" : "");
    return status;
  };
  try {
    return part();
  } catch (const Information& asked) {
    std::fputs(asked.text.c_str(), stdout);
    return exitDone;
  } catch (const UsageError& error) {
    return fail(exitUsage, error.what());
  } catch (const FileError& error) {
    return fail(exitFile, error.what());
  } catch (const pcl::mrf::Error& error) {
    return fail(statusOf(error), pcl::mrf::withOptionNames(error.message(), pcl::mrf::OptionNaming::flags));
  } catch (const std::bad_alloc&) {
    return fail(exitMethod, "out of memory" + (memoryAdvice.empty() ? "" : "; " + memoryAdvice));
  } catch (const std::exception& error) {
    return fail(exitMethod, error.what());
  }
}

int toolMain(const std::string& name, const std::string& memoryAdvice, const std::function<int()>& tool)
{
  // The library's class logs its errors as well; once is enough.
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  keepFreedMemory();
  removeTemporaryFilesOnSignals();
  return guarded(name, {}, memoryAdvice, tool);
}

} // namespace mrf_apps
