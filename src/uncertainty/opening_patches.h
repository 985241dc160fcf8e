// SPDX-License-Identifier: BSD-3-Clause
/// Discs of points that are left out, to learn how well openings of the same sizes are filled.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// A disc of points that are left out, all of one sheet.
struct Patch {
  Eigen::Vector3f center;
  float radius; ///< cloud's unit
  std::vector<std::uint32_t> points;
};

/// The openings of a surface.
struct Openings {
  std::vector<Eigen::Vector3f> vertices; ///< of the mesh, without support
  float largest = 0;                     ///< largest distance from a vertex to its nearest point, cloud's unit
};

/// Chooses discs as wide as the widest opening and narrower ones, down to half of that, apart from each other and from
/// the openings; at most a twelfth of the points in all. No discs if even one of the narrowest has too many points.
/// \param narrowest minimum radius, cloud's unit: the points around a narrower disc would support the surface in it
/// The result depends on the points alone. Cost: a few hundred searches.
std::vector<Patch> choosePatches(const OrientedPoints& points, const NeighborSearch& search, const Openings& openings,
                                 float narrowest, Execution& execution);

} // namespace pcl::mrf
