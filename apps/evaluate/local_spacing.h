// SPDX-License-Identifier: BSD-3-Clause
/// The local sampling density of a cloud, and its point nearest to a place.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>

#include <Eigen/Core>

#include <memory>
#include <vector>

namespace mrf_apps {

/// A cloud with the spacing of its points: .313 times the distance to the 8th neighbor, which is 1/(2√ρ) at ρ points
/// per area, the mean distance to the closest point where points are random. Unlike the closest point, the 8th neighbor
/// measures ρ also where points are spread evenly or lie on scan lines. Coincident points count once.
class LocalSpacing {
public:
  /// The point of the cloud nearest to a place.
  struct Nearest {
    double distance = 0; ///< cloud's unit
    double spacing = 0;  ///< of that point, cloud's unit, above 0
  };

  /// \param points finite
  /// Cost: one query of nine neighbors per point. The result does not depend on the number of threads.
  LocalSpacing(std::vector<Eigen::Vector3d> points, pcl::mrf::Execution& execution);

  /// False if fewer than nine points are distinct: there are no spacings then.
  bool isKnown() const { return !spacings_.empty(); }

  /// The nearest points of places. \pre isKnown(), the places are finite
  /// Distances are computed in double, to a point that is nearest up to 10⁻⁷ of the cloud's diagonal.
  std::vector<Nearest> nearest(const std::vector<Eigen::Vector3d>& places, pcl::mrf::Execution& execution) const;

private:
  Eigen::Vector3f inFrame(const Eigen::Vector3d& place) const;

  std::vector<Eigen::Vector3d> points_; ///< the distinct ones
  std::vector<double> spacings_;        ///< of these
  // The search works on floats, in a frame in which the diagonal of the cloud is 1.
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero();
  double diagonal_ = 0;
  std::unique_ptr<pcl::mrf::NeighborSearch> search_;
};

} // namespace mrf_apps
