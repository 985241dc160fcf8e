// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief How densely a cloud is sampled at each of its points, and its point nearest to a place.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>

#include <Eigen/Core>

#include <memory>
#include <vector>

namespace mrf_apps {

/// The point of a cloud that is closest to a place.
struct NearestPoint {
  double distance = 0;   ///< cloud's unit
  std::size_t point = 0; ///< of the cloud; of coincident ones the first
};

/// A cloud with the spacing of its points: .313 times the distance to the 8th neighbor, which is 1/(2√ρ) at ρ points
/// per area, the mean distance to the closest point where points are random. The 8th neighbor measures ρ where they are
/// spread evenly or lie on scan lines as well, which the closest one does not. Coincident points count once.
class LocalSpacing {
public:
  /// The number of distinct points that a spacing takes: the point itself and eight neighbors.
  static constexpr int pointsNeeded = 9;

  /// \param points finite
  /// Cost: one query of nine neighbors per point. The result does not depend on the number of threads.
  LocalSpacing(const std::vector<Eigen::Vector3d>& points, pcl::mrf::Execution& execution);

  /// Of each point, cloud's unit, above 0; empty if fewer than nine points are distinct.
  const std::vector<double>& spacings() const { return spacings_; }

  /// The nearest point of each place. \pre spacings() is not empty, the places are finite
  /// Distances are those of doubles to the point that is nearest up to 10⁻⁷ of the cloud's diagonal.
  std::vector<NearestPoint> nearest(const std::vector<Eigen::Vector3d>& places, pcl::mrf::Execution& execution) const;

private:
  void findDistinct();
  Eigen::Vector3f inFrame(const Eigen::Vector3d& place) const;
  double spacingOf(std::size_t distinct, pcl::mrf::Neighbors& found) const;

  std::vector<Eigen::Vector3d> points_;
  std::vector<std::size_t> distinct_;   ///< points at different places
  std::vector<std::size_t> distinctOf_; ///< index into distinct_ of each point
  // The search works on floats: in a frame in which the cloud is as large as 1.
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero();
  double diagonal_ = 0;
  std::unique_ptr<pcl::mrf::NeighborSearch> search_; ///< in the distinct points
  std::vector<double> spacings_;
};

} // namespace mrf_apps
