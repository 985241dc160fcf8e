// SPDX-License-Identifier: BSD-3-Clause
/// Finds where sheets of a surface are close to each other, or a sheet is folded, so that triangles may intersect.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include "base/cell_hash.h"

#include <Eigen/Core>

#include <vector>

namespace pcl::mrf {

/// A grid of cells. A cell is crowded if the normals of the surface in it and in the 26 cells around it differ much.
///
/// Two close sheets of a zero level face opposite ways, or a third sheet between them faces the other way. So if all
/// normals in and around a cell are within 60° of their mean, there is one sheet: the graph of a function above a
/// plane. Triangles that follow it do not intersect.
class CrowdedSpace {
public:
  /// \param normals unit length, one per position \param side edge length of a cell, cloud's unit
  /// Cost: linear in the number of positions. The result does not depend on the number of threads.
  CrowdedSpace(const std::vector<Eigen::Vector3f>& positions, const std::vector<Eigen::Vector3f>& normals, float side,
               Execution& execution);

  bool contains(const Eigen::Vector3f& position) const;

private:
  struct Cell {
    Eigen::Vector3f axis = Eigen::Vector3f::Zero(); ///< unit length, mean of the normals
    float cosine = 1;                               ///< min cosine between a normal and the axis
    bool isCrowded = false;
  };

  bool isCrowdedAround(const CellHash::Cell& place) const;

  CellHash hash_; ///< cells beyond its end share one, which may look crowded: no harm
  std::vector<Cell> cells_;
};

} // namespace pcl::mrf
