// SPDX-License-Identifier: BSD-3-Clause
/// The parts of a cloud that are solved on their own, each with its points, its search and its volume.
#pragma once

#include "levels/multiscale.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <memory>
#include <vector>

namespace pcl::mrf {

/// A cloud whose parts cannot see each other in parts, any other as a whole.
class CloudPieces {
public:
  /// Drops points that are alone. \param points, search outlive this; the search holds the points
  /// \param options with the voxel size
  CloudPieces(OrientedPoints& points, NeighborSearch& search, const Options& options, Report& report,
              Execution& execution);
  CloudPieces(const CloudPieces&) = delete;
  CloudPieces& operator=(const CloudPieces&) = delete;

  /// By falling number of points.
  const std::vector<SolvedPiece>& all() const { return pieces_; }

  /// What limits of holes follow: what lies far apart has no holes as wide as that. \return cloud's unit
  float largestDiagonal() const;

  /// Lets the fields cover more than the boxes of their points, where the padding is automatic.
  /// \param options with all lengths
  void growVolumes(const Options& options, Report& report, Execution& execution);

private:
  std::vector<OrientedPoints> points_; ///< of each piece, if there are several
  std::vector<std::unique_ptr<NeighborSearch>> searches_;
  std::vector<SolvedPiece> pieces_;
};

} // namespace pcl::mrf
