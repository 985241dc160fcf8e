// SPDX-License-Identifier: BSD-3-Clause
/// The pieces of a cloud that are solved separately, each with its points, its search and its volume.
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

/// Splits a cloud into pieces if its parts are too far apart to influence each other; else the cloud is one piece.
class CloudPieces {
public:
  /// Drops points that are alone. \param points, search must outlive this; the search holds the points
  /// \param options with the voxel size
  CloudPieces(OrientedPoints& points, NeighborSearch& search, const Options& options, Report& report,
              Execution& execution);
  CloudPieces(const CloudPieces&) = delete;
  CloudPieces& operator=(const CloudPieces&) = delete;

  /// All pieces, largest first by number of points.
  const std::vector<SolvedPiece>& all() const { return pieces_; }

  /// The largest diagonal of a piece's bounding box, cloud's unit. Automatic limits of holes are derived from it,
  /// because no hole is wider than a piece.
  float largestDiagonal() const;

  /// Extends the volumes of the fields beyond the boxes of the points, if the padding is automatic.
  /// \param options with all lengths
  void growVolumes(const Options& options, Report& report, Execution& execution);

private:
  std::vector<OrientedPoints> points_; ///< points of each piece; empty if there is only one piece
  std::vector<std::unique_ptr<NeighborSearch>> searches_;
  std::vector<SolvedPiece> pieces_;
};

} // namespace pcl::mrf
