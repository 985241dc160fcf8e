// SPDX-License-Identifier: BSD-3-Clause
/// The library's options as texts, for the command line and for Python's keywords.
#pragma once

#include <pcl/surface/mrf/option_table.h>

#include <functional>
#include <string>

namespace mrf_apps {

/// The help of an option, with its range and its default.
std::string helpOf(const pcl::mrf::OptionDeclaration& option);

/// Sets an option to a word, a number or "auto".
/// \return the error, worded to follow the text in a message; empty if the option was set
std::string setByText(pcl::mrf::Options& options, const pcl::mrf::OptionDeclaration& option, const std::string& text);

/// Help of the noise model, which is a text and not in the table of options.
extern const char* const noiseModelHelp;

/// \param isGiven whether an option was given, by its flag
/// \throw UsageError if an option was given that has no meaning with the others
void requireMeaning(const pcl::mrf::Options& options, const std::function<bool(const std::string&)>& isGiven);

} // namespace mrf_apps
