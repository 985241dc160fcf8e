// SPDX-License-Identifier: BSD-3-Clause
#include "sensors.h"

#include "errors.h"
#include "text_file.h"

#include <algorithm>
#include <cmath>

namespace mrf_apps {
namespace {

/// Calls use(values) on every row of `columns` finite numbers.
template <typename Use>
void forEachRow(const std::string& path, const std::string& text, std::size_t columns, const char* what, const Use& use)
{
  std::string_view line;
  std::vector<std::string_view> words;
  std::vector<double> values;
  for (Lines lines(text); lines.next(line);) {
    splitRow(line, words);
    if (words.empty() || words[0][0] == '#')
      continue;
    const auto isFinite = [](double value) { return std::isfinite(value); };
    if (!toNumbers(words, values) || values.size() != columns || !std::all_of(values.begin(), values.end(), isFinite) ||
        !use(values))
      throw FileError(path, lines.number(), std::string("is not ") + what);
  }
}

} // namespace

bool parseSensor(const std::string& text, Eigen::Vector3d& position)
{
  std::vector<std::string_view> words;
  std::vector<double> values;
  splitRow(text, words);
  if (!toNumbers(words, values) || values.size() != 3)
    return false;
  position = {values[0], values[1], values[2]};
  return position.allFinite();
}

std::vector<Eigen::Vector3d> parseSensors(const std::string& path, const std::string& text)
{
  std::vector<Eigen::Vector3d> sensors;
  forEachRow(path, text, 3, "a position x y z", [&](const std::vector<double>& values) {
    sensors.emplace_back(values[0], values[1], values[2]);
    return true;
  });
  if (sensors.empty())
    throw FileError(path, "holds no sensor positions");
  return sensors;
}

std::vector<std::int32_t> parseViews(const std::string& path, const std::string& text)
{
  std::vector<std::int32_t> views;
  forEachRow(path, text, 1, "the number of a sensor, from 0", [&](const std::vector<double>& values) {
    views.push_back(static_cast<std::int32_t>(isCount(values[0]) ? values[0] : 0));
    return isCount(values[0]);
  });
  return views;
}

} // namespace mrf_apps
