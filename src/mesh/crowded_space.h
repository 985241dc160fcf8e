// SPDX-License-Identifier: BSD-3-Clause
/// Where sheets of a surface are so close to each other, or one so folded, that its triangles may meet.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include "base/cell_hash.h"

#include <Eigen/Core>

#include <vector>

namespace pcl::mrf {

/// Cells of a grid around which the normals of a surface differ much.
///
/// Two sheets of a zero level that are close to each other either face opposite ways or have a third one between them
/// that does. So where all normals within a cell's side of a cell are within 60° of their mean there is one sheet, the
/// graph of a function above a plane, and triangles that follow it do not meet.
class CrowdedSpace {
public:
  /// \param normals unit, one per position \param side of the cells, cloud's unit
  /// Cost: linear in the number of positions. The result does not depend on the number of threads.
  CrowdedSpace(const std::vector<Eigen::Vector3f>& positions, const std::vector<Eigen::Vector3f>& normals, float side,
               Execution& execution);

  bool contains(const Eigen::Vector3f& position) const;

private:
  struct Cell {
    Eigen::Vector3f axis = Eigen::Vector3f::Zero(); ///< unit, mean of the normals
    float cosine = 1;                               ///< to it, the smallest
    bool isCrowded = false;
  };

  bool isCrowdedAround(const CellHash::Cell& place) const;

  CellHash hash_; ///< far cells share one: they look crowded, no more
  std::vector<Cell> cells_;
};

} // namespace pcl::mrf
