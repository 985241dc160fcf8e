// SPDX-License-Identifier: BSD-3-Clause
/// Parts of a cloud that are too far apart to say anything about each other (ours).
#pragma once

#include <pcl/surface/mrf/point_set.h>

#include <cstdint>
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

} // namespace pcl::mrf
