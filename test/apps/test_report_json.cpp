// SPDX-License-Identifier: BSD-3-Clause
// The report's JSON: it has every declared option with its name and value, and its documentation lists all keys.
#include <pcl/surface/mrf/option_table.h>

#include "support/report_json.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <regex>
#include <set>
#include <string>

using namespace pcl::mrf;
using Json = nlohmann::ordered_json;

namespace {

Json optionOf(const Options& options, const OptionDeclaration& option)
{
  Report report;
  report.options = options;
  std::string pointer = "/options/" + option.name;
  if (const std::size_t dot = pointer.find('.'); dot != std::string::npos)
    pointer[dot] = '/';
  return mrf_apps::toJson(report).at(Json::json_pointer(pointer));
}

/// A number in the unit of its member, which differs from the option's unit only for MiB.
double numberIn(const OptionDeclaration& option, double value)
{
  return option.unit == "MiB" ? value * 1024 * 1024 : value;
}

/// Adds the names of all members and of their members, except those of the options, which have a help.
void addKeys(const Json& json, std::set<std::string>& keys)
{
  for (const auto& [key, value] : json.items()) {
    if (json.is_object())
      keys.insert(key);
    if (key != "options" && value.is_structured())
      addKeys(value, keys);
  }
}

/// The words in backticks of the first column of the table in apps/README.md.
std::set<std::string> documentedKeys()
{
  std::ifstream file(MRF_SOURCE_DIR "/apps/README.md");
  std::set<std::string> keys;
  std::string line;
  while (std::getline(file, line) && line != "| key | what it is |")
    continue;
  const std::regex quoted("`([^`]*)`"), name("[A-Za-z0-9]+");
  while (std::getline(file, line) && !line.empty()) {
    line = line.substr(0, line.find(" | "));
    for (std::sregex_iterator quote(line.begin(), line.end(), quoted), end; quote != end; ++quote) {
      const std::string path = (*quote)[1];
      for (std::sregex_iterator part(path.begin(), path.end(), name); part != end; ++part)
        keys.insert(part->str());
    }
  }
  return keys;
}

} // namespace

TEST(ReportJson, showsEveryOptionAsItWasSet)
{
  for (const OptionDeclaration& option : optionDeclarations()) {
    SCOPED_TRACE(option.name);
    Options options;
    if (option.isNumber()) {
      const double other = option.get(options) == 7 ? 8 : option.range.contains(7) ? 7 : .25;
      ASSERT_TRUE(option.set(options, other));
      const Json shown = optionOf(options, option);
      EXPECT_EQ(shown.get<double>(), numberIn(option, other));
      EXPECT_EQ(shown.is_number_integer(), option.isWhole || option.unit == "MiB");
      continue;
    }
    const bool isSwitch = option.words.front().first == "on";
    for (const auto& [word, value] : option.words) {
      ASSERT_TRUE(option.set(options, value));
      EXPECT_EQ(optionOf(options, option), isSwitch ? Json(word == "on") : Json(word));
    }
  }
}

TEST(ReportJson, hasTextsAndWholeNumbersThatADoubleCannotHold)
{
  Report report;
  report.options.confidenceField = "quality";
  EXPECT_EQ(mrf_apps::toJson(report).at("options").at("confidenceField"), "quality");

  Options large;
  large.solver.seed = (std::uint64_t{1} << 60) + 1;
  EXPECT_EQ(optionOf(large, optionDeclaration("solver.seed")).get<std::uint64_t>(), large.solver.seed);
}

TEST(ReportJson, hasTheKeysOfTheTable)
{
  Report report;
  report.noise.groups.resize(1);
  report.smoothing.curve.resize(1);
  report.resolution.curve.resize(1);
  report.levels.resize(1);
  report.otherPieces.resize(1);
  report.times.resize(1);
  report.uncertainty.isComputed = true;
  report.options.uncertainty.maxError = 1;
  std::set<std::string> keys = {"schema", "tool", "version", "input", "output", "offset"}; // those of the run
  for (const bool isByRange : {false, true}) {
    report.noise.isByRange = isByRange;
    addKeys(mrf_apps::toJson(report), keys);
  }
  EXPECT_EQ(documentedKeys(), keys);
}
