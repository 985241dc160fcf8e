// SPDX-License-Identifier: BSD-3-Clause
/// Discs of points that are left out to learn how well openings of the same sizes are filled.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Points of a cloud that are left out, all of one sheet.
struct Patch {
  Eigen::Vector3f center;
  float radius; ///< cloud's unit
  std::vector<std::uint32_t> points;
};

/// The openings of a surface: its vertices without support.
struct Openings {
  std::vector<Eigen::Vector3f> vertices;
  float largest = 0; ///< the largest distance of one to the nearest point, cloud's unit

  /// \param distance of a vertex of the mesh to the nearest point; 0: it has support
  void add(const Eigen::Vector3f& vertex, float distance);
};

/// Discs as wide as the widest opening, and some narrower by up to half, apart from each other and from the openings;
/// at most a twelfth of the points in all. None if even one of the narrowest has too many points.
/// \param narrowest radius below which the points around a disc support what is in it, cloud's unit
/// The result depends on the points alone. Cost: a few hundred searches.
std::vector<Patch> choosePatches(const OrientedPoints& points, const NeighborSearch& search, const Openings& openings,
                                 float narrowest, Execution& execution);

} // namespace pcl::mrf
