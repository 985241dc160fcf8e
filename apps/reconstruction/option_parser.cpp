// SPDX-License-Identifier: BSD-3-Clause
#include "option_parser.h"
#include "support/option_text.h"

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

} // namespace

std::string OptionParser::set(const OptionDeclaration& option, const std::string& text)
{
  Options trial;
  const std::string wrong = setByText(trial, option, text);
  if (wrong.empty())
    changes_.push_back([&option, text](Options& options) { setByText(options, option, text); });
  return wrong;
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
  return words(option.flag, all, helpOf(option), [this, &option](const std::string& text) { set(option, text); });
}

CLI::Option* OptionParser::declaredFlag(const std::string& name)
{
  const OptionDeclaration& option = pcl::mrf::optionDeclaration(name);
  return flag(option.flag, option.help,
              [this, &option] { changes_.push_back([&option](Options& options) { option.set(options, 1); }); });
}

} // namespace mrf_apps
