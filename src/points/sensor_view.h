// SPDX-License-Identifier: BSD-3-Clause
/// The points as a sensor sees them.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include <Eigen/Core>

#include <cstdint>
#include <memory>
#include <vector>

namespace pcl::mrf {

/// Points moved along their lines of sight onto a sphere around their sensor, where points behind each other are
/// neighbors. The sphere is as large as the points are far away, so that a far sensor tells them apart as well.
class SensorView {
public:
  /// \param positions search() holds these positions as moved onto the sphere, in their order
  SensorView(const Eigen::Vector3f& sensor, const std::vector<Eigen::Vector3f>& positions, Execution& execution);

  Eigen::Vector3f onSphere(const Eigen::Vector3f& position) const;

  /// Length on the sphere of a short line across the line of sight at `position`, in lengths of the line.
  float scaleAt(const Eigen::Vector3f& position) const;

  const std::vector<Eigen::Vector3f>& seen() const { return seen_; }
  const NeighborSearch& search() const { return *search_; }

private:
  const Eigen::Vector3d sensor_;
  double radius_;
  std::vector<Eigen::Vector3f> seen_;
  std::unique_ptr<NeighborSearch> search_;
};

/// For each of points.sensors the indices of the points that it saw, by points.views; empty if that is unknown. A
/// single sensor saw all points.
std::vector<std::vector<std::uint32_t>> pointsOfSensors(const PointArrays& points);

} // namespace pcl::mrf
