// SPDX-License-Identifier: BSD-3-Clause
/// How far points may be apart to belong together.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace pcl::mrf {

/// How far each point looks for neighbors: two of them are neighbors if each is within the other's reach.
class Reach {
public:
  /// The same for all points.
  explicit Reach(float distance) : distance_(distance) {}
  /// So many of its own spacings for each point.
  Reach(std::vector<float> spacings, float factor) : distances_(std::move(spacings))
  {
    for (float& distance : distances_)
      distance *= factor;
  }

  float of(std::size_t i) const { return distances_.empty() ? distance_ : distances_[i]; }

  bool isLocal() const { return !distances_.empty(); }

  bool joins(std::size_t i, std::size_t j, float squaredDistance) const
  {
    // In this order: a neighbor that does not exist is infinitely far.
    return squaredDistance <= of(i) * of(i) && squaredDistance <= of(j) * of(j);
  }

private:
  float distance_ = 0;
  std::vector<float> distances_;
};

} // namespace pcl::mrf
