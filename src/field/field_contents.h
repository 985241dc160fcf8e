// SPDX-License-Identifier: BSD-3-Clause
/// The storage of a distance field in a band, and the part of a field around a box, to be sent to another process.
#pragma once

#include "field/voxel_set.h"

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>

#include <Eigen/Geometry>

#include <vector>

namespace pcl::mrf {

/// The storage of a DistanceField in a band.
struct BandedDistances {
  VoxelSet band;                  ///< on the bands' grid, gridMargin voxels around the lattice
  PackedValues values;            ///< packed on the band
  std::vector<float> confidences; ///< likewise; may be empty
  DistanceField background;       ///< on a coarser lattice that covers the field's
};

/// The part of one piece of a field around a box: all values of a dense field, and some rows and planes of a band.
struct FieldContents {
  Lattice lattice; ///< as it is stored
  AxisOrder axes;
  std::vector<float> distances; ///< of a dense field
  VoxelSet band;
  PackedValues values;                   ///< packed on the band
  std::vector<FieldContents> background; ///< one entry for a field in a band, none for a dense one

  /// The parts of all pieces. \param box in the recentered frame, in which toField() reads bit by bit the same
  static std::vector<FieldContents> of(const DistanceField& field, const Eigen::AlignedBox3d& box,
                                       Execution& execution);

  /// A field that reads the same as the original in the box. It has no confidences.
  static DistanceField toField(std::vector<FieldContents> pieces);

private:
  static FieldContents ofPiece(const DistanceField& piece, const Eigen::AlignedBox3d& box, Execution& execution);
  DistanceField toPiece() &&;
};

} // namespace pcl::mrf
