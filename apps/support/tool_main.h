// SPDX-License-Identifier: BSD-3-Clause
/// Turns exceptions into one line on standard error and an exit status, for all tools.
#pragma once

#include <functional>
#include <string>

namespace mrf_apps {

/// Runs a tool. \param memoryAdvice what to do when memory runs out, may be empty
/// \param tool returns the exit status, see ExitStatus
/// \return that status, or the one for the exception that the tool throws
int toolMain(const std::string& name, const std::string& memoryAdvice, const std::function<int()>& tool);

/// Runs a part of a tool; what it throws becomes a line on standard error.
/// \param subject the input that the part is about, which every line names; may be empty
/// \return what the part returns, or the exit status for what it throws
int guarded(const std::string& name, const std::string& subject, const std::string& memoryAdvice,
            const std::function<int()>& part);

} // namespace mrf_apps
