// SPDX-License-Identifier: BSD-3-Clause
/// Parts of a cloud that are too far apart to say anything about each other (ours); each is solved separately.
#pragma once

#include "levels/multiscale.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace pcl::mrf {

struct Pieces {
  /// Indices of the points of each piece, ascending; largest piece first. Empty: the whole cloud is one piece.
  std::vector<std::vector<std::uint32_t>> points;
  /// Indices of the points in pieces with fewer than minPointsOfSurface points.
  std::vector<std::uint32_t> alone;
};

/// Splits a cloud into pieces if every gap is wide compared with the groups beside it. Groups are the points in cubic
/// cells of side c that touch; c is the smallest of `minGap`, 2 minGap, 4 minGap … with c ≥ 4 D + minGap, D the
/// diagonal of the largest group's box. Boxes that grow by up to D / 2 + minGap / 8 on each side then do not overlap.
/// The cloud stays one piece if more than a tenth of its points is in groups of fewer than twelve: so thinly spread
/// points are no set of objects.
/// \param minGap > 0, cloud's unit
/// Cost: linear in the number of points, n log n in that of the cells.
Pieces findPieces(const std::vector<Eigen::Vector3f>& positions, float minGap);

/// The pieces of a cloud, each with its points, its search and its volume; the cloud itself if it is one piece.
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
