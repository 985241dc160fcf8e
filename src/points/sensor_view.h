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

/// Points moved along their lines of sight onto a sphere around their sensor, where what is behind a place is next to
/// it. The sphere is as large as they are far, so that far sensors tell points apart, too.
class SensorView {
public:
  /// \param positions of which `search` holds those on the sphere, in their order
  SensorView(const Eigen::Vector3f& sensor, const std::vector<Eigen::Vector3f>& positions, Execution& execution);

  Eigen::Vector3f onSphere(const Eigen::Vector3f& position) const;

  const std::vector<Eigen::Vector3f>& seen() const { return seen_; }
  const NeighborSearch& search() const { return *search_; }

private:
  const Eigen::Vector3d sensor_;
  double radius_;
  std::vector<Eigen::Vector3f> seen_;
  std::unique_ptr<NeighborSearch> search_;
};

/// For each of points.sensors the indices of the points that it saw, by points.views; none where it is not known who
/// saw them.
std::vector<std::vector<std::uint32_t>> pointsOfSensors(const PointArrays& points);

} // namespace pcl::mrf
