/// \file
/// \brief CLI11 options that set members of pcl::mrf::Options, on top of a preset.
#pragma once

#include "support/option_names.h"
#include "support/text_file.h"

#include <pcl/surface/mrf/options.h>

#include <CLI/CLI.hpp>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace mrf_apps {

/// Numbers that an option takes.
struct Range {
  double lower = 0, upper = std::numeric_limits<double>::infinity();
  bool lowerOpen = false, upperOpen = false;

  bool contains(double value) const
  {
    return std::isfinite(value) && (lowerOpen ? value > lower : value >= lower) &&
           (upperOpen ? value < upper : value <= upper);
  }
  std::string text() const;
};

/// Whether a number of the range is in it still when it has the type of its member: in single precision 1e39 is
/// infinite, and .99999999 is 1. \param factor the member's unit in the number's
template <typename Value>
bool isStorable(double number, const Range& range, double factor = 1)
{
  if (!(number * factor < static_cast<double>(std::numeric_limits<Value>::max())))
    return false;
  const double stored = static_cast<double>(static_cast<Value>(number * factor)) / factor;
  return !(range.lowerOpen && stored <= range.lower) && !(range.upperOpen && stored >= range.upper);
}

/// Shortest decimal text of a number.
std::string decimal(double value);

/// A member of Options.
template <typename Value>
auto field(Value pcl::mrf::Options::*member)
{
  return [member](pcl::mrf::Options& options) -> Value& { return options.*member; };
}

/// A member of one of its structs.
template <typename Stage, typename Value>
auto field(Stage pcl::mrf::Options::*stage, Value Stage::*member)
{
  return [stage, member](pcl::mrf::Options& options) -> Value& { return options.*stage.*member; };
}

/// Registers options with their defaults, collects what the user set, and applies it to a preset.
class OptionParser {
public:
  using Options = pcl::mrf::Options;

  explicit OptionParser(CLI::App& app) : app_(app) {}

  /// Later options appear under this heading of the help.
  void group(const std::string& name) { group_ = name; }

  /// A number. \param member as `field` makes it
  /// \param automatic what 0 stands for, shown as the default; empty: the default is shown as a number
  /// \param factor the member's unit in the option's
  template <typename Member>
  CLI::Option* number(const std::string& name, const std::string& unit, const Range& range, Member member,
                      const std::string& help, const std::string& automatic = {}, double factor = 1)
  {
    using Value = std::decay_t<decltype(member(defaults_))>;
    const double value = static_cast<double>(member(defaults_)) / factor;
    const std::string byDefault = automatic.empty() ? decimal(value) : automatic;
    return add(name, unit, help + ", " + range.text() + "; default " + byDefault,
               [this, name, range, member, factor](const std::string& text) {
                 double parsed = 0;
                 constexpr bool whole = std::is_integral_v<Value>;
                 const bool isNumber = toNumber(text, parsed);
                 if (!isNumber || !range.contains(parsed) || (whole && parsed != std::floor(parsed)))
                   throw CLI::ValidationError(name, "'" + text + "' is not a " + (whole ? "whole " : "") +
                                                        "number in the range " + range.text());
                 if (!isStorable<Value>(parsed, range, factor))
                   throw CLI::ValidationError(name, "'" + text + "' cannot be stored as a number in the range " +
                                                        range.text());
                 changes_.push_back([=](Options& o) { member(o) = static_cast<Value>(parsed * factor); });
               });
  }

  /// One of the named values of an enumeration.
  template <typename Member>
  CLI::Option* choice(const std::string& name, Member member, const std::string& help)
  {
    using Value = std::decay_t<decltype(member(defaults_))>;
    std::vector<std::string> words;
    for (const auto& entry : names<Value>())
      words.push_back(entry.first);
    return add(name, CLI::detail::join(words, "|"), help + "; default " + nameOf(member(defaults_)),
               [this, name, words, member](const std::string& text) {
                 for (const auto& [word, value] : names<Value>())
                   if (word == text) {
                     changes_.push_back([member, chosen = value](Options& o) { member(o) = chosen; });
                     return;
                   }
                 throw CLI::ValidationError(name, "'" + text + "' is none of " + CLI::detail::join(words, ", "));
               });
  }

  /// on or off.
  template <typename Member>
  CLI::Option* onOff(const std::string& name, Member member, const std::string& help)
  {
    return add(name, "on|off", help + "; default " + (member(defaults_) ? "on" : "off"),
               [this, name, member](const std::string& text) {
                 if (text != "on" && text != "off")
                   throw CLI::ValidationError(name, "'" + text + "' is neither on nor off");
                 changes_.push_back([member, on = text == "on"](Options& o) { member(o) = on; });
               });
  }

  CLI::Option* text(const std::string& name, const std::string& unit, std::string& target, const std::string& help)
  {
    return add(name, unit, help, [name, &target](const std::string& value) {
      if (value.empty())
        throw CLI::ValidationError(name, "needs a value");
      target = value;
    });
  }

  CLI::Option* flag(const std::string& name, const std::string& help, const std::function<void(Options&)>& change)
  {
    return app_
        .add_flag_callback(
            name, [this, change] { changes_.push_back(change); }, help)
        ->group(group_);
  }

  /// Registers any option that takes one word.
  CLI::Option* add(const std::string& name, const std::string& unit, const std::string& help,
                   const std::function<void(const std::string&)>& set)
  {
    return app_.add_option_function<std::string>(name, set, help)->type_name(unit)->group(group_);
  }

  /// Has the options changed by what the user set.
  void change(const std::function<void(Options&)>& change) { changes_.push_back(change); }

  /// Applies what the user set, in the order of the help.
  void apply(Options& options) const
  {
    for (const auto& change : changes_)
      change(options);
  }

private:
  CLI::App& app_;
  std::string group_;
  Options defaults_ = pcl::mrf::defaultPreset();
  std::vector<std::function<void(Options&)>> changes_;
};

} // namespace mrf_apps
