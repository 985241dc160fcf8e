// SPDX-License-Identifier: BSD-3-Clause
/// Parts of a cloud that are too far apart to say anything about each other (ours).
#pragma once

#include <pcl/surface/mrf/point_set.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

struct Pieces {
  /// Indices into the points, ascending, of each piece; pieces by falling number of points. Empty: all are one piece.
  std::vector<std::vector<std::uint32_t>> points;
  /// Of the points that are alone: fewer than minPointsOfSurface, as far from all others as pieces are from each other.
  std::vector<std::uint32_t> alone;
};

/// Splits a cloud where every gap is wide beside everything on either side of it: between groups of points in cubic
/// cells of side c that touch, for the smallest c of `minGap`, 2 minGap, 4 minGap … with c ≥ 4 D + minGap, D the
/// diagonal of the largest group's box. Boxes that grow by up to D / 2 + minGap / 8 on each side then stay apart. There
/// are no pieces but one where more than a tenth of the points is in groups of fewer than twelve: what is spread as
/// thinly as that is no set of objects. \param minGap > 0, cloud's unit Cost: linear in the number of points, and n log
/// n in that of the cells.
Pieces findPieces(const std::vector<Eigen::Vector3f>& positions, float minGap);

} // namespace pcl::mrf
