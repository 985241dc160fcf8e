// SPDX-License-Identifier: BSD-3-Clause
/// The points as a sensor sees them.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include <Eigen/Core>

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace pcl::mrf {

/// How far apart in depth a point and what is behind it are at least: by that much neither slope nor noise explain it.
/// \param spacing local one \param deviation σ of the noise, same unit; 0: unknown
float clearance(float spacing, float deviation);

/// Max distance of a sensor from the middle of the points, in diagonals; what is farther away is a direction.
constexpr float maxDiagonals = 100;

/// Points moved along their lines of sight onto a sphere around their sensor, where points behind each other are
/// neighbors. The sphere is as large as the points are far away, or as they are wide, so that any sensor tells them
/// apart.
class SensorView {
public:
  /// \param positions search() holds these positions as moved onto the sphere, in their order
  SensorView(const Eigen::Vector3f& sensor, const std::vector<Eigen::Vector3f>& positions, Execution& execution);

  Eigen::Vector3f onSphere(const Eigen::Vector3f& position) const;

  /// Length on the sphere of a short line across the line of sight at `position`, in lengths of the line.
  float scaleAt(const Eigen::Vector3f& position) const;

  /// Distance of a place from the sensor.
  float distance(const Eigen::Vector3f& position) const;

  /// Whether the line of sight to a place passes within half a spacing of one of the points that count, which is nearer
  /// to the sensor by more than `margin`. \param spacings of the points \param counts called with their indices
  bool isBehindSome(const Eigen::Vector3f& position, float margin, const std::vector<float>& spacings,
                    const std::function<bool(std::size_t)>& counts, Neighbors& besides) const;

  const std::vector<Eigen::Vector3f>& seen() const { return seen_; }
  const std::vector<float>& distances() const { return distances_; } ///< of the points from the sensor
  const NeighborSearch& search() const { return *search_; }

private:
  const Eigen::Vector3d sensor_;
  double radius_;
  std::vector<Eigen::Vector3f> seen_;
  std::vector<float> distances_;
  std::unique_ptr<NeighborSearch> search_;
};

/// For each of points.sensors the indices of the points that it saw, by points.views; empty if that is unknown. A
/// single sensor saw all points.
std::vector<std::vector<std::uint32_t>> pointsOfSensors(const PointArrays& points);

/// Share of the points that their sensors did not see, because others of these sensors hide them; of 2,048 points of
/// the eight sensors that saw most. \param spacings local ones
double hiddenShare(const PointArrays& points, const std::vector<float>& spacings, Execution& execution);

} // namespace pcl::mrf
