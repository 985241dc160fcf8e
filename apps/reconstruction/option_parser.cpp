// SPDX-License-Identifier: BSD-3-Clause
#include "option_parser.h"

namespace mrf_apps {
namespace {

using pcl::mrf::OptionDeclaration;

/// What the help calls a number of this unit.
std::string upperCase(std::string unit)
{
  for (char& c : unit)
    if (c >= 'a' && c <= 'z')
      c = static_cast<char>(c - 'a' + 'A');
  return unit;
}

std::string helpOf(const OptionDeclaration& option)
{
  std::string text = option.help;
  if (option.isNumber())
    text += ", " + option.range.text();
  const bool isAutomatic = !option.automatic.empty() && option.get(pcl::mrf::defaultPreset()) == 0;
  return text + "; default " + (isAutomatic ? "auto: " : "") + option.defaultText();
}

} // namespace

std::string OptionParser::set(const OptionDeclaration& option, const std::string& text)
{
  double value = 0;
  if (text != "auto" || option.automatic.empty()) {
    if (!toNumber(text, value))
      return "is not a number" + std::string(option.automatic.empty() ? "" : " or auto") + "; its range is " +
             option.range.text();
    if (option.isWhole && value != std::floor(value))
      return "is not a whole number; its range is " + option.range.text();
    if (!option.accepts(value))
      return "is " + option.refusal();
  }
  Options trial;
  if (!option.set(trial, value))
    return "cannot be stored as a number of its range " + option.range.text();
  changes_.push_back([&option, value](Options& options) { option.set(options, value); });
  return {};
}

CLI::Option* OptionParser::declared(const std::string& name)
{
  const OptionDeclaration& option = pcl::mrf::optionDeclaration(name);
  if (option.isNumber())
    return add(option.flag, upperCase(option.unit), helpOf(option),
               [this, &option](const std::string& text) { return set(option, text); });
  std::vector<std::string> all;
  for (const auto& entry : option.words)
    all.push_back(entry.first);
  return words(option.flag, all, helpOf(option), [this, &option](const std::string& text) {
    for (const auto& [word, value] : option.words)
      if (word == text)
        changes_.push_back([&option, chosen = value](Options& options) { option.set(options, chosen); });
  });
}

CLI::Option* OptionParser::declaredFlag(const std::string& name)
{
  const OptionDeclaration& option = pcl::mrf::optionDeclaration(name);
  return flag(option.flag, option.help,
              [this, &option] { changes_.push_back([&option](Options& options) { option.set(options, 1); }); });
}

} // namespace mrf_apps
