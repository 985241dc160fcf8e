// SPDX-License-Identifier: BSD-3-Clause
#include "float_offset.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace mrf_apps {
namespace {

/// The box of some thousand points without the lowest and the highest hundredth along each axis: a few strays far away
/// must not decide how many digits the other points need.
Eigen::AlignedBox3d innerBox(std::size_t points, const std::function<Eigen::Vector3d(std::size_t)>& position)
{
  constexpr std::size_t samples = 5000;
  std::array<std::vector<double>, 3> coordinates;
  const std::size_t step = points / samples + 1;
  for (std::size_t i = 0; i < points; i += step)
    if (const Eigen::Vector3d place = position(i); place.allFinite())
      for (std::size_t axis = 0; axis < 3; ++axis)
        coordinates[axis].push_back(place[axis]);
  Eigen::AlignedBox3d box;
  const std::size_t count = coordinates[0].size();
  if (count == 0)
    return box;
  Eigen::Vector3d lower, upper;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::sort(coordinates[axis].begin(), coordinates[axis].end());
    lower[axis] = coordinates[axis][count / 100];
    upper[axis] = coordinates[axis][count - 1 - count / 100];
  }
  return {lower, upper};
}

float stepAt(float value)
{
  return std::nextafter(value, std::numeric_limits<float>::infinity()) - value;
}

/// The distance between floats at the farthest coordinates of a box, over its diagonal.
double coarseness(const Eigen::AlignedBox3d& box)
{
  const auto farthest = static_cast<float>(box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff());
  return static_cast<double>(stepAt(farthest)) / box.diagonal().norm();
}

} // namespace

Eigen::Vector3d floatOffset(std::size_t points, const std::function<Eigen::Vector3d(std::size_t)>& position)
{
  const Eigen::AlignedBox3d box = innerBox(points, position);
  const bool areFine = box.isEmpty() || coarseness(box) <= 2e-7;
  return areFine ? Eigen::Vector3d::Zero() : Eigen::Vector3d(box.center());
}

bool needDoubles(std::size_t points, const std::function<Eigen::Vector3d(std::size_t)>& position)
{
  const Eigen::AlignedBox3d box = innerBox(points, position);
  return !box.isEmpty() && std::sqrt(static_cast<double>(points)) * coarseness(box) > 1e-3;
}

float floatRounding(const std::vector<Eigen::Vector3d>& positions)
{
  float widest = 0;
  for (const Eigen::Vector3d& position : positions)
    for (const double coordinate : position) {
      const auto value = static_cast<float>(std::abs(coordinate));
      std::uint32_t bits = 0;
      std::memcpy(&bits, &value, sizeof(bits));
      if ((bits & 1) != 0 && std::isfinite(value))
        widest = std::max(widest, stepAt(value));
    }
  return widest;
}

} // namespace mrf_apps
