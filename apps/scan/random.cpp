// SPDX-License-Identifier: BSD-3-Clause
#include "random.h"

#include <cmath>

namespace pcl::mrf::scan {

std::uint64_t mix(std::uint64_t x)
{
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

std::size_t Random::index(std::size_t count)
{
  // Values beyond the last whole multiple of count are drawn again.
  const std::uint64_t n = count, excess = (UINT64_MAX % n + 1) % n;
  std::uint64_t x = engine_();
  while (x > UINT64_MAX - excess)
    x = engine_();
  return static_cast<std::size_t>(x % n);
}

double Random::normal()
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

Eigen::Vector3d Random::normalVector()
{
  // One by one: the order in which arguments are evaluated is not specified.
  Eigen::Vector3d v;
  for (int axis = 0; axis < 3; ++axis)
    v[axis] = normal();
  return v;
}

Eigen::Vector3d Random::direction()
{
  Eigen::Vector3d v;
  do
    v = normalVector().normalized();
  while (v.isZero());
  return v;
}

} // namespace pcl::mrf::scan
