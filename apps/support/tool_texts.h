// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What a tool tells of itself, and the forms in which it does: help, manual page, completion.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace mrf_apps {

/// One option of a tool.
struct OptionText {
  std::string name;               ///< "--quiet"
  std::string shortName;          ///< "-q", or empty
  std::string value;              ///< "LENGTH"; empty: a flag
  std::string help;               ///< with limits and default
  std::string group;              ///< heading
  std::vector<std::string> words; ///< that it takes; empty: any
};

/// All that is told of a tool.
struct ToolTexts {
  std::string tool, version;
  std::string summary;            ///< what it does, a sentence
  std::vector<std::string> usage; ///< command lines without the tool's name
  std::vector<std::pair<std::string, std::string>> operands;
  std::vector<OptionText> options;
  std::vector<std::pair<std::string, std::string>> everyday; ///< options of the short help, in words of their own
  std::vector<std::string> examples;                         ///< command lines without the tool's name
  std::vector<std::string> notes;                            ///< paragraphs; lines keep their indentation
};

/// Everyday options and examples, on a screen.
std::string shortHelp(const ToolTexts& texts);

/// All options, by their groups.
std::string fullHelp(const ToolTexts& texts);

/// For man, as a page of section 1.
std::string manualPage(const ToolTexts& texts);

/// A script for bash: of options and the words that some take; it completes files by itself.
std::string bashCompletion(const ToolTexts& texts);

} // namespace mrf_apps
