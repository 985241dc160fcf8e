// SPDX-License-Identifier: BSD-3-Clause
/// The library's options as texts, for whoever types them: on a command line, or as keywords of Python.
#pragma once

#include <pcl/surface/mrf/option_table.h>

#include <functional>
#include <string>

namespace mrf_apps {

/// What an option does, with its range and its default.
std::string helpOf(const pcl::mrf::OptionDeclaration& option);

/// Sets an option to a word, a number or "auto".
/// \return what is wrong with the text, to be put behind it; empty: nothing
std::string setByText(pcl::mrf::Options& options, const pcl::mrf::OptionDeclaration& option, const std::string& text);

/// Of the noise's model, which is a text and no row of the table.
extern const char* const noiseModelHelp;

/// \param isGiven whether an option was given, by its flag
/// \throw UsageError if one was that has no meaning with the others
void requireMeaning(const pcl::mrf::Options& options, const std::function<bool(const std::string&)>& isGiven);

} // namespace mrf_apps
