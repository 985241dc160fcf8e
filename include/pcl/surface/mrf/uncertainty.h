// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Error bars: how far the surface may be off at each vertex, given the points (ours).
#pragma once

#include <pcl/surface/mrf/export.h>

#include <cstdint>

namespace pcl {
namespace mrf {

/// What sigma is: half of the width of an interval around the vertex, along its normal, that holds the surface in 68 of
/// 100 cases, and twice as wide in 95. Errors of registration, and normals that point to the wrong side, are not in it.
struct UncertaintyOptions {
  bool compute = false; ///< sigma per vertex, and the report's part; needs observations at points
  int samples = 8;      ///< draws from the posterior, 2..1000; their seed is that of the solver
};

/// \throw InvalidOption naming the first field that is out of range
PCL_MRF_EXPORT void validate(const UncertaintyOptions& options);

/// Of the sigma of some vertices, cloud's unit.
struct SigmaQuantiles {
  std::int64_t vertices = 0;
  double median = 0, percentile95 = 0, max = 0;
};

/// What sigma was learnt from, and how large it is.
struct UncertaintyReport {
  bool isComputed = false; ///< all else is zero if it is not
  int samples = 0;         ///< draws from the posterior
  double voxelSize = 0;    ///< of the grid that they were drawn on, cloud's unit; of pieces the coarsest
  std::int64_t voxels = 0; ///< of that grid

  double noise = 0;         ///< of the scanner: what neighboring points that were left out do not share, cloud's unit
  std::int64_t heldOut = 0; ///< points that were left out amid others, by pairs; 0: none could be
  double measuredError = 0; ///< what such pairs share, RMS, cloud's unit: the surface's own error amid data

  std::int64_t patches = 0;       ///< discs of points that were left out to be filled
  std::int64_t patchPoints = 0;   ///< in them
  double largestPatch = 0;        ///< diameter of the largest one, cloud's unit
  double largestOpening = 0;      ///< diameter of the largest filling, as trimming measures it
  double fillingFactor = 0;       ///< standard deviation of the data that the fillings' errors speak for, cloud's unit
  std::int64_t notCalibrated = 0; ///< vertices whose sigma is an extrapolation

  SigmaQuantiles measured; ///< of vertices with a confidence above 0
  SigmaQuantiles fillings; ///< of the others
};

} // namespace mrf
} // namespace pcl
