// SPDX-License-Identifier: BSD-3-Clause
/// The options of a tool: each is declared once, for the parser, the help, the manual page and the completion.
#pragma once

#include "text_file.h"

#include <CLI/CLI.hpp>
#include <Eigen/Core>

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
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
  std::vector<std::string> words; ///< the only ones allowed; empty: any
};

/// The texts about a tool.
struct ToolTexts {
  std::string tool, version;
  std::string summary;            ///< what it does, a sentence
  std::vector<std::string> usage; ///< command lines without the tool's name
  std::vector<std::pair<std::string, std::string>> operands;
  std::vector<OptionText> options;
  std::vector<std::pair<std::string, std::string>> everyday; ///< options of the short help, with their texts there
  std::vector<std::string> examples;                         ///< command lines without the tool's name
  std::map<std::string, std::string> hints;                  ///< for names of options in other programs
  std::vector<std::string> notes;                            ///< paragraphs; lines keep their indentation
};

/// The everyday options and an example; fits on a screen.
std::string shortHelp(const ToolTexts& texts);

/// All options by groups.
std::string fullHelp(const ToolTexts& texts);

/// A page of section 1 for man.
std::string manualPage(const ToolTexts& texts);

/// A script for bash that completes options and their words; bash itself completes files.
std::string bashCompletion(const ToolTexts& texts);

/// Registers options and parses the command line. Targets must live until it is parsed.
class ToolOptions {
public:
  /// \param version such as "1.2.3" \param summary a sentence
  ToolOptions(const std::string& tool, const std::string& version, const std::string& summary);
  ToolOptions(const ToolOptions&) = delete;
  ToolOptions& operator=(const ToolOptions&) = delete;

  ToolTexts texts; ///< the texts beside those of the options are set by the tool

  /// The words that belong to no option are stored in the target. \param max number of them
  void operands(std::vector<std::string>& target, std::size_t max);
  /// Later options appear under this heading of the help.
  void group(const std::string& name) { group_ = name; }

  // All options below are named "--name" or "-n,--name", and may be given once.

  /// An option with a value. \param unit name of the value in the help
  /// \param set returns the error, worded to follow the value in a message; empty if the value is valid
  CLI::Option* add(const std::string& name, const std::string& unit, const std::string& help,
                   const std::function<std::string(const std::string&)>& set);

  /// Takes any word.
  CLI::Option* text(const std::string& name, const std::string& unit, std::string& target, const std::string& help)
  {
    return add(name, unit, help, [&target](const std::string& word) {
      target = word;
      return "";
    });
  }

  /// Takes one of several words. \param set gets the word
  CLI::Option* words(const std::string& name, const std::vector<std::string>& words, const std::string& help,
                     const std::function<void(const std::string&)>& set);

  CLI::Option* flag(const std::string& name, const std::string& help, const std::function<void()>& set);
  CLI::Option* flag(const std::string& name, bool& target, const std::string& help);

  void number(const std::string& name, const std::string& unit, double& target, const std::string& help,
              double above = -std::numeric_limits<double>::infinity());
  void positive(const std::string& name, const std::string& unit, double& target, const std::string& help)
  {
    number(name, unit, target, help, 0);
  }

  template <typename Integer>
  void whole(const std::string& name, Integer& target, double lower, double upper, const std::string& help)
  {
    add(name, "N", help, [&target, lower, upper](const std::string& text) {
      double value = 0;
      const std::string wrong = checkWhole(text, lower, upper, value);
      if (wrong.empty())
        target = static_cast<Integer>(value);
      return wrong;
    });
  }

  /// Up to 2^53, as far as a double holds all whole numbers.
  void seed(std::uint64_t& target, const std::string& help) { whole("--seed", target, 0, 0x1p53, help); }

  void threads(int& target, const std::string& help) { whole("--threads", target, 0, 1024, help); }

  void vector(const std::string& name, Eigen::Vector3d& target, const std::string& help);
  /// Takes one more vector each time it is given.
  CLI::Option* vectors(const std::string& name, std::vector<Eigen::Vector3d>& targets, const std::string& help);

  /// The name of a file. \param unit "FILE.json" requires this extension
  CLI::Option* file(const std::string& name, const std::string& unit, std::string& target, const std::string& help);

  template <typename Value>
  void choice(const std::string& name, const std::vector<std::pair<std::string, Value>>& choices,
              const std::function<void(Value)>& set, const std::string& help)
  {
    std::vector<std::string> all;
    for (const auto& entry : choices)
      all.push_back(entry.first);
    words(name, all, help, [choices, set](const std::string& text) {
      for (const auto& [word, value] : choices)
        if (word == text)
          set(value);
    });
  }

  bool isGiven(const std::string& name) const { return app_.get_option(name)->count() > 0; }

  /// \throw UsageError, Information
  void parse(int argc, const char* const* argv);

private:
  static std::string checkWhole(const std::string& text, double lower, double upper, double& value);
  OptionText& describe(const std::string& name, const std::string& help);
  void information(const std::string& name, const std::string& help, const std::function<std::string()>& text);
  [[noreturn]] void refuseUnknown(const std::vector<std::string>& typed) const;

  CLI::App app_;
  std::string group_ = "Options";
  std::vector<OptionText> last_; ///< options listed behind all others
};

} // namespace mrf_apps
