// SPDX-License-Identifier: BSD-3-Clause
/// What a distance field is made of: in a band, and around a part of it, to be sent elsewhere.
#pragma once

#include "field/voxel_set.h"

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>

#include <Eigen/Geometry>

#include <vector>

namespace pcl::mrf {

/// What a DistanceField in a band holds.
struct BandedDistances {
  VoxelSet band;                  ///< on the bands' grid, gridMargin voxels around the lattice
  PackedValues values;            ///< packed on the band
  std::vector<float> confidences; ///< likewise; may be empty
  DistanceField background;       ///< on a coarser lattice that covers the field's
};

/// One piece of a field. Dense values are whole, and bands have the voxels of some rows and planes.
struct FieldContents {
  Lattice lattice; ///< as it is stored
  AxisOrder axes;
  std::vector<float> distances; ///< of a dense field
  VoxelSet band;
  PackedValues values;                   ///< packed on the band
  std::vector<FieldContents> background; ///< one of a field in a band

  /// Those of all pieces. \param box of the recentered frame, around which they are bit by bit what they are
  static std::vector<FieldContents> of(const DistanceField& field, const Eigen::AlignedBox3d& box,
                                       Execution& execution);

  /// A field that reads the same in the box, without confidences.
  static DistanceField toField(std::vector<FieldContents> pieces);

private:
  static FieldContents ofPiece(const DistanceField& piece, const Eigen::AlignedBox3d& box, Execution& execution);
  DistanceField toPiece() &&;
};

} // namespace pcl::mrf
