/// \file
/// \brief What a DistanceField in a band holds.
#pragma once

#include "band.h"

#include <pcl/surface/mrf/distance_field.h>

#include <vector>

namespace pcl {
namespace mrf {

struct BandedDistances {
  Band band;                      ///< on the bands' grid, bandMargin voxels around the lattice
  PackedValues values;            ///< packed on the band
  std::vector<float> confidences; ///< likewise; may be empty
  DistanceField background;       ///< dense, on a coarser lattice that covers the field's
};

} // namespace mrf
} // namespace pcl
