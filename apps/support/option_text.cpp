// SPDX-License-Identifier: BSD-3-Clause
#include "option_text.h"

#include "errors.h"
#include "text_file.h"

#include <algorithm>
#include <cmath>

namespace mrf_apps {

using pcl::mrf::OptionDeclaration;
using pcl::mrf::Options;

const char* const noiseModelHelp =
    "what the noise is like: automatic, as the cloud shows it; none, left to points that are left out; or its "
    "standard deviation at a range z from the sensor: constant:S, quadratic:A,B (A + B z^2), tof:A,B (A + B z), "
    "kinect:D,F "
    "(D z^2 / F, with disparities off by D pixels and F focal length times baseline; kinect alone: .088 and 43.5 m); "
    "default automatic";

namespace {

/// Converts "8G", "8GiB" and the decimal "8GB" to a number of MiB. Returns a text with another ending as it is.
std::string inMebibytes(const std::string& text)
{
  const std::size_t end = text.find_last_of("0123456789.") + 1;
  const std::string suffix = text.substr(end);
  double value = 0, binary = 1, decimal = 1e6 / (1 << 20);
  for (const char unit : {'M', 'G', 'T'}) {
    const bool isDecimal = suffix == std::string{unit} + "B";
    if ((isDecimal || suffix == std::string{unit} || suffix == std::string{unit} + "iB") &&
        toNumber(text.substr(0, end), value))
      return pcl::mrf::decimalText((isDecimal ? decimal : binary) * value);
    binary *= 1024;
    decimal *= 1000;
  }
  return text;
}

} // namespace

std::string helpOf(const OptionDeclaration& option)
{
  std::string text = option.help;
  if (option.isNumber())
    text += ", " + option.range.text();
  const bool isAutomatic = !option.automatic.empty() && option.get(pcl::mrf::defaultPreset()) == 0;
  return text + "; default " + (isAutomatic ? "auto: " : "") + option.defaultText();
}

std::string setByText(Options& options, const OptionDeclaration& option, const std::string& text)
{
  double value = 0;
  if (!option.isNumber()) {
    const auto word = std::find_if(option.words.begin(), option.words.end(),
                                   [&](const auto& candidate) { return candidate.first == text; });
    if (word == option.words.end())
      return "is " + option.refusal();
    value = word->second;
  } else if (text != "auto" || option.automatic.empty()) {
    if (!toNumber(option.unit == "MiB" ? inMebibytes(text) : text, value))
      return "is not a number" + std::string(option.automatic.empty() ? "" : " or auto") + "; its range is " +
             option.range.text();
    if (option.isWhole && value != std::floor(value))
      return "is not a whole number; its range is " + option.range.text();
    if (!option.accepts(value))
      return "is " + option.refusal();
  }
  return option.set(options, value) ? "" : "cannot be stored as a number of its range " + option.range.text();
}

void requireMeaning(const Options& options, const std::function<bool(const std::string&)>& isGiven)
{
  if (isGiven("--max-hole") && options.trimming.kind != pcl::mrf::Trimming::holes)
    throw UsageError("--max-hole has a meaning with --trim holes only");
  if (isGiven("--samples") && !wantsUncertainty(options))
    throw UsageError("--samples has a meaning with --uncertainty or --color sigma only");
  const bool atPoints = options.observation.atPoints();
  for (const char* name : {"--smoothing", "--noise", "--noise-model", "--noise-field", "--gradient-weight"})
    if (!atPoints && isGiven(name))
      throw UsageError(std::string(name) + " has a meaning with --observation points only");
  for (const char* name : {"--beta", "--energy", "--neighbors"})
    if (atPoints && isGiven(name))
      throw UsageError(std::string(name) + " has no meaning with --observation points; choose another one");
}

} // namespace mrf_apps
