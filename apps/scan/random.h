// SPDX-License-Identifier: BSD-3-Clause
/// Random numbers with a stream for each purpose.
///
/// C++ specifies its engines to the bit, but not its distributions and std::shuffle. Those here give the same numbers
/// with every standard library.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace pcl::mrf::scan {

/// One step of the splitmix64 generator: turns a counter into well mixed bits.
std::uint64_t mix(std::uint64_t x);

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
  std::size_t index(std::size_t count);
  /// Standard normal deviate, by Marsaglia's polar method.
  double normal();
  Eigen::Vector3d normalVector();
  /// Uniform on the unit sphere.
  Eigen::Vector3d direction();

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
