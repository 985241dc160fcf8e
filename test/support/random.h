// SPDX-License-Identifier: BSD-3-Clause
/// Random numbers for programs that draw their cases.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <cstdint>
#include <random>

namespace clouds {

/// Random numbers that are the same with every standard library.
class Random {
public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// In [0, count). The bias of the remainder does not matter here.
  std::size_t index(std::size_t count) { return static_cast<std::size_t>(engine_() % count); }
  bool oneIn(std::size_t count) { return index(count) == 0; }
  double uniform(double lower, double upper)
  {
    constexpr double all = 18446744073709551616.;
    return lower + (upper - lower) * (static_cast<double>(engine_()) / all);
  }
  /// 10 to a uniform power.
  double decades(double lowerPower, double upperPower) { return std::pow(10., uniform(lowerPower, upperPower)); }
  /// In [-1, 1]³.
  Eigen::Vector3d inCube()
  {
    const double x = uniform(-1, 1), y = uniform(-1, 1);
    return {x, y, uniform(-1, 1)};
  }
  /// Uniform on the unit sphere.
  Eigen::Vector3d direction()
  {
    const double z = uniform(-1, 1), around = uniform(0, 2 * M_PI), r = std::sqrt(1 - z * z);
    return {r * std::cos(around), r * std::sin(around), z};
  }

private:
  std::mt19937_64 engine_;
};

} // namespace clouds
