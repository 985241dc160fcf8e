/// \file
/// \brief From exceptions to one line on standard error and an exit status, for all tools.
#pragma once

#include <functional>
#include <string>

namespace mrf_apps {

/// Runs a tool. \param memoryAdvice what to do when memory runs out, may be empty
/// \return the exit status: see ExitStatus
int toolMain(const std::string& name, const std::string& memoryAdvice, const std::function<void()>& tool);

/// Gives the memory that tools keep for their next arrays back to the system, which needs as many pages for a file that
/// is about to be written. Three million points, after a pause: a tenth of the system's time.
void releaseFreedMemory();

} // namespace mrf_apps
