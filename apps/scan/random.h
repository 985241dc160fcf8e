// SPDX-License-Identifier: BSD-3-Clause
/// Random numbers with a stream for each purpose.
///
/// C++ specifies its engines to the bit, but not its distributions and std::shuffle. Those here give the same numbers
/// with every standard library.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace pcl::mrf::scan {

/// One step of the splitmix64 generator: turns a counter into well mixed bits.
inline std::uint64_t mix(std::uint64_t x)
{
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// In [0, 1), of 53 random bits.
inline double share(std::uint64_t bits)
{
  return static_cast<double>(bits >> 11) * 0x1p-53;
}

class Random {
public:
  /// Streams of one seed are independent of each other: a stage that draws more numbers does not change the next one.
  Random(std::uint64_t seed, std::uint64_t stream) : engine_(mix(seed ^ mix(stream))) {}

  std::uint64_t bits() { return engine_(); }
  /// In [0, 1).
  double uniform() { return share(engine_()); }
  double uniform(double lower, double upper) { return lower + (upper - lower) * uniform(); }

  /// In [0, count), without bias.
  std::size_t index(std::size_t count)
  {
    // Values beyond the last whole multiple of count are drawn again.
    const std::uint64_t n = count, excess = (UINT64_MAX % n + 1) % n;
    std::uint64_t x = engine_();
    while (x > UINT64_MAX - excess)
      x = engine_();
    return static_cast<std::size_t>(x % n);
  }

  /// Standard normal deviate, by Marsaglia's polar method.
  double normal()
  {
    if (hasSpare_) {
      hasSpare_ = false;
      return spare_;
    }
    double x, y, square;
    do {
      x = 2 * uniform() - 1;
      y = 2 * uniform() - 1;
      square = x * x + y * y;
    } while (square >= 1 || square == 0);
    const double factor = std::sqrt(-2 * std::log(square) / square);
    spare_ = y * factor;
    hasSpare_ = true;
    return x * factor;
  }

  Eigen::Vector3d normalVector()
  {
    // One by one: the order in which arguments are evaluated is not specified.
    Eigen::Vector3d v;
    for (int axis = 0; axis < 3; ++axis)
      v[axis] = normal();
    return v;
  }

  /// Uniform on the unit sphere.
  Eigen::Vector3d direction()
  {
    Eigen::Vector3d v;
    do
      v = normalVector().normalized();
    while (v.isZero());
    return v;
  }

  template <typename T>
  void shuffle(std::vector<T>& values)
  {
    for (std::size_t i = values.size(); i > 1; --i)
      std::swap(values[i - 1], values[index(i)]);
  }

private:
  std::mt19937_64 engine_;
  double spare_ = 0;
  bool hasSpare_ = false;
};

} // namespace pcl::mrf::scan
