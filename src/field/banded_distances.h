// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What a DistanceField in a band holds.
#pragma once

#include "field/voxel_set.h"

#include <pcl/surface/mrf/distance_field.h>

#include <vector>

namespace pcl::mrf {

struct BandedDistances {
  VoxelSet band;                  ///< on the bands' grid, gridMargin voxels around the lattice
  PackedValues values;            ///< packed on the band
  std::vector<float> confidences; ///< likewise; may be empty
  DistanceField background;       ///< dense, on a coarser lattice that covers the field's
};

} // namespace pcl::mrf
