// SPDX-License-Identifier: BSD-3-Clause
#include "options/noise_law.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <vector>

namespace pcl::mrf {
namespace {

/// A PrimeSense-like camera. The disparity's error includes .08 pixels of noise and rounding to eighths of a pixel.
constexpr double kinectDisparity = .088, kinectFocalBaseline = 43.5; // pixels, pixels · m

[[noreturn]] void refuse(const std::string& model, const std::string& why)
{
  throw InvalidOption("observation.noiseModel = " + model + " " + why +
                      "; it is automatic, none, constant:S, quadratic:A,B, tof:A,B, kinect or kinect:D,F, with numbers "
                      "in the cloud's unit");
}

/// The numbers of a comma-separated list; none for empty text.
std::vector<double> numbersOf(const std::string& model, const std::string& text)
{
  std::vector<double> numbers;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    double number = 0;
    const char* const last = text.data() + end;
    const auto read = std::from_chars(text.data() + at, last, number);
    if (read.ec != std::errc() || read.ptr != last || !std::isfinite(number) || number < 0)
      refuse(model, "has '" + text.substr(at, end - at) + "' where a number of at least 0 is wanted");
    numbers.push_back(number);
    at = end + 1;
  }
  if (!text.empty() && text.back() == ',')
    refuse(model, "ends in a comma");
  return numbers;
}

} // namespace

std::optional<NoiseLaw> noiseLaw(const std::string& model)
{
  if (model == "automatic" || model == "none")
    return {};
  const std::size_t colon = std::min(model.find(':'), model.size());
  const std::string name = model.substr(0, colon);
  std::vector<double> numbers = numbersOf(model, model.substr(std::min(colon + 1, model.size())));
  if (name == "kinect" && colon == model.size())
    numbers = {kinectDisparity, kinectFocalBaseline};
  static const std::map<std::string, std::size_t> counts = {
      {"constant", 1}, {"quadratic", 2}, {"tof", 2}, {"kinect", 2}};
  const auto count = counts.find(name);
  if (count == counts.end())
    refuse(model, "is no such model");
  if (numbers.size() != count->second)
    refuse(model, "has " + std::to_string(numbers.size()) + " numbers where " + name + " takes " +
                      std::to_string(count->second));
  NoiseLaw law;
  if (name == "constant")
    law.constant = numbers[0];
  else if (name == "quadratic")
    law = {numbers[0], 0, numbers[1]};
  else if (name == "tof")
    law = {numbers[0], numbers[1], 0};
  else if (numbers[1] > 0)
    law.quadratic = numbers[0] / numbers[1];
  else
    refuse(model, "has no focal length times baseline");
  if (!(law.deviation(1) > 0))
    refuse(model, "is no noise");
  return law;
}

double constantNoise(const ObservationOptions& options)
{
  if (options.noise > 0)
    return static_cast<double>(options.noise);
  const std::optional<NoiseLaw> law = noiseLaw(options.noiseModel);
  return law && !law->isByRange() ? law->constant : 0;
}

} // namespace pcl::mrf
