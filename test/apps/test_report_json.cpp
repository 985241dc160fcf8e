// SPDX-License-Identifier: BSD-3-Clause
// The report's JSON: every declared option is in it, under its key and with its value.
#include <pcl/surface/mrf/option_table.h>

#include "support/report_json.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <string>

using namespace pcl::mrf;
using Json = nlohmann::ordered_json;

namespace {

Json optionOf(const Options& options, const OptionDeclaration& option)
{
  Report report;
  report.options = options;
  std::string pointer = "/options/" + option.key;
  if (const std::size_t dot = pointer.find('.'); dot != std::string::npos)
    pointer[dot] = '/';
  return mrf_apps::toJson(report).at(Json::json_pointer(pointer));
}

/// A number in its member's unit: of all units MiB alone is not.
double numberIn(const OptionDeclaration& option, double value)
{
  return option.unit == "MiB" ? value * 1024 * 1024 : value;
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

TEST(ReportJson, hasKeysOfItsOwnAndWholeNumbersThatADoubleCannotHold)
{
  const Options options = paperPreset();
  EXPECT_EQ(optionOf(options, optionDeclaration("observation.kind")), "median");
  EXPECT_EQ(optionDeclaration("observation.kind").key, "observation.estimate");
  EXPECT_EQ(optionDeclaration("prior.kind").key, "prior.prior");
  EXPECT_EQ(optionDeclaration("trimming.kind").key, "trimming.trimming");
  Report report;
  report.options.confidenceField = "quality";
  EXPECT_EQ(mrf_apps::toJson(report).at("options").at("confidenceField"), "quality");

  Options large;
  large.solver.seed = (std::uint64_t{1} << 60) + 1;
  EXPECT_EQ(optionOf(large, optionDeclaration("solver.seed")).get<std::uint64_t>(), large.solver.seed);
}
