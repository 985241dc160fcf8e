// SPDX-License-Identifier: BSD-3-Clause
/// From where the points were seen.
#pragma once

#include <pcl/surface/mrf/point_set.h>

#include <Eigen/Core>

#include <optional>
#include <vector>

namespace pcl::mrf {

/// The sensors, or 256 of them, if the points face them; where none are given, the direction of a single far one that
/// saw all points, if there can have been one.
class Viewpoints {
public:
  explicit Viewpoints(const OrientedPoints& points);

  bool areKnown() const;

  /// Cosine between the normal of a place and the line of sight to it that meets it most squarely: near 0 or below, no
  /// sensor could see a surface there. \pre areKnown()
  float facing(const Eigen::Vector3f& position, const Eigen::Vector3f& normal) const;

private:
  std::vector<Eigen::Vector3f> sensors_;     ///< that saw the points
  std::optional<Eigen::Vector3f> direction_; ///< to the far sensor
};

} // namespace pcl::mrf
