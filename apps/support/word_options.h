/// \file
/// \brief CLI11 options of one word each, with messages that say what the word should be.
#pragma once

#include "text_file.h"

#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace mrf_apps {

/// Registers options in groups of the help. Targets live as long as the parse.
class WordOptions {
public:
  explicit WordOptions(CLI::App& app) : app_(app) {}

  /// Later options appear under this heading of the help.
  void group(const std::string& name) { group_ = name; }

  /// \param set returns false if the word is not what is \p wanted
  void add(const std::string& name, const std::string& unit, const std::string& help,
           const std::function<bool(const std::string&)>& set, const std::string& wanted)
  {
    // Of "-o,--output" the long name.
    const std::string told = name.substr(name.rfind(',') + 1);
    app_.add_option_function<std::string>(
            name,
            [=](const std::string& text) {
              if (!set(text))
                throw CLI::ValidationError(told, "'" + text + "' is not " + wanted);
            },
            help)
        ->type_name(unit)
        ->group(group_);
  }

  void number(const std::string& name, const std::string& unit, double& target, const std::string& help)
  {
    add(
        name, unit, help,
        [&target](const std::string& text) { return toNumber(text, target) && std::isfinite(target); }, "a number");
  }

  void positive(const std::string& name, const std::string& unit, double& target, const std::string& help)
  {
    add(
        name, unit, help,
        [&target](const std::string& text) { return toNumber(text, target) && std::isfinite(target) && target > 0; },
        "a positive number");
  }

  template <typename Integer>
  void whole(const std::string& name, Integer& target, double least, double most, const std::string& help)
  {
    const auto set = [&target, least, most](const std::string& text) {
      double value = 0;
      if (!toNumber(text, value) || value != std::floor(value) || !(value >= least && value <= most))
        return false;
      target = static_cast<Integer>(value);
      return true;
    };
    const auto digits = [](double value) { return std::to_string(static_cast<std::int64_t>(value)); };
    add(name, "N", help, set, "a whole number from " + digits(least) + " to " + digits(most));
  }

  /// Up to 2^53: larger ones would not be the number that was typed.
  void seed(std::uint64_t& target, const std::string& help) { whole("--seed", target, 0, 0x1p53, help); }

  void threads(int& target, const std::string& help) { whole("--threads", target, 0, 1024, help); }

  void path(const std::string& name, const std::string& unit, std::string& target, const std::string& help,
            const std::string& wanted = "the name of a file")
  {
    const auto set = [&target](const std::string& text) {
      target = text;
      return !text.empty();
    };
    add(name, unit, help, set, wanted);
  }

  void flag(const std::string& name, const std::string& help, const std::function<void()>& set)
  {
    app_.add_flag_callback(name, set, help)->group(group_);
  }

  template <typename Value>
  void choice(const std::string& name, const std::vector<std::pair<std::string, Value>>& choices, Value& target,
              const std::string& help)
  {
    std::vector<std::string> words;
    for (const auto& entry : choices)
      words.push_back(entry.first);
    const auto set = [choices, &target](const std::string& text) {
      for (const auto& [word, value] : choices)
        if (word == text) {
          target = value;
          return true;
        }
      return false;
    };
    add(name, CLI::detail::join(words, "|"), help, set, "one of " + CLI::detail::join(words, ", "));
  }

private:
  CLI::App& app_;
  std::string group_ = "Options"; ///< CLI11's own heading
};

} // namespace mrf_apps
