// SPDX-License-Identifier: BSD-3-Clause
/// How far points may be apart to belong together.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace pcl::mrf {

/// How far each point looks for neighbors, cloud's unit. Two points are neighbors if each is within the other's reach.
class Reach {
public:
  /// The same reach for all points.
  explicit Reach(float distance) : distance_(distance) {}
  /// A reach of `factor` times its own spacing for each point.
  Reach(std::vector<float> spacings, float factor) : distances_(std::move(spacings))
  {
    for (float& distance : distances_)
      distance *= factor;
  }

  float of(std::size_t i) const { return distances_.empty() ? distance_ : distances_[i]; }

  bool isLocal() const { return !distances_.empty(); }

  bool joins(std::size_t i, std::size_t j, float squaredDistance) const
  {
    // In this order: a missing neighbor has an infinite distance, so that its index is not used.
    return squaredDistance <= of(i) * of(i) && squaredDistance <= of(j) * of(j);
  }

private:
  float distance_ = 0;
  std::vector<float> distances_;
};

} // namespace pcl::mrf
