/// \file
/// \brief From exceptions to one line on standard error and an exit status, for all tools.
#pragma once

#include <functional>
#include <string>

namespace mrf_apps {

/// Runs a tool. \param memoryAdvice what to do when memory runs out, may be empty
/// \return the exit status: see ExitStatus
int toolMain(const std::string& name, const std::string& memoryAdvice, const std::function<void()>& tool);

} // namespace mrf_apps
