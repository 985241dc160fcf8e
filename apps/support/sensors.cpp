// SPDX-License-Identifier: BSD-3-Clause
#include "sensors.h"

#include "errors.h"
#include "text_file.h"

namespace mrf_apps {
namespace {

/// \return false unless the words are three finite numbers
bool toPosition(const std::vector<std::string_view>& words, Eigen::Vector3d& position)
{
  bool isGood = words.size() == 3;
  for (std::size_t axis = 0; isGood && axis < 3; ++axis)
    isGood = toNumber(words[axis], position[static_cast<Eigen::Index>(axis)]);
  return isGood && position.allFinite();
}

/// \param take gets the words of each row and returns false if they are invalid
template <typename Take>
void forEachRow(const std::string& path, const std::string& text, const char* what, const Take& take)
{
  std::string_view line;
  std::vector<std::string_view> words;
  for (Lines lines(text, path); lines.next(line);) {
    splitRow(line, words);
    if (!words.empty() && words[0][0] != '#' && !take(words))
      lines.fail(std::string("is not ") + what);
  }
}

} // namespace

bool parseSensor(const std::string& text, Eigen::Vector3d& position)
{
  std::vector<std::string_view> words;
  splitRow(text, words);
  return toPosition(words, position);
}

std::vector<Eigen::Vector3d> parseSensors(const std::string& path, const std::string& text)
{
  std::vector<Eigen::Vector3d> sensors;
  forEachRow(path, text, "a position x y z",
             [&](const std::vector<std::string_view>& words) { return toPosition(words, sensors.emplace_back()); });
  if (sensors.empty())
    throw FileError(path, "holds no sensor positions");
  return sensors;
}

std::vector<std::int32_t> parseViews(const std::string& path, const std::string& text)
{
  std::vector<std::int32_t> views;
  forEachRow(path, text, "the number of a sensor, from 0", [&](const std::vector<std::string_view>& words) {
    double number = -1;
    const bool isGood = words.size() == 1 && toNumber(words[0], number) && isCount(number);
    views.push_back(static_cast<std::int32_t>(isGood ? number : 0));
    return isGood;
  });
  return views;
}

} // namespace mrf_apps
