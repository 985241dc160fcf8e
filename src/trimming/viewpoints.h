// SPDX-License-Identifier: BSD-3-Clause
/// The directions from which the points were seen.
#pragma once

#include <pcl/surface/mrf/point_set.h>

#include <Eigen/Core>

#include <optional>
#include <vector>

namespace pcl::mrf {

/// The sensors, or 256 of them, if the points face them. If no sensors are given: the direction of one far sensor that
/// may have seen all points, if there is one.
class Viewpoints {
public:
  explicit Viewpoints(const OrientedPoints& points);

  bool areKnown() const;

  /// Max cosine between the normal at a position and the directions from there to the sensors: near 0 or below, no
  /// sensor could see a surface there. \pre areKnown()
  float facing(const Eigen::Vector3f& position, const Eigen::Vector3f& normal) const;

private:
  std::vector<Eigen::Vector3f> sensors_;     ///< that saw the points
  std::optional<Eigen::Vector3f> direction_; ///< to the far sensor
};

} // namespace pcl::mrf
