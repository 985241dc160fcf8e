// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Error bars: how far the surface may be off at each vertex, given the points (ours).
#pragma once

#include <pcl/surface/mrf/export.h>

#include <array>
#include <cstdint>

namespace pcl {
namespace mrf {

/// What sigma is: half of the width of an interval around the vertex, along its normal, that holds the surface in 68 of
/// 100 cases, and twice as wide in 95. Errors of registration, and normals that point to the wrong side, are not in it.
struct UncertaintyOptions {
  bool compute = false; ///< sigma per vertex, and the report's part; needs observations at points
  int samples = 8;      ///< draws from the posterior, 2..1000; their seed is that of the solver
  /// Surfaces that sigma allows for, which come with the result, 0..1000; sigma is computed for them. Each is one of
  /// the draws, of which there are at least as many. Where they are wider than the object is thin, they may intersect.
  int surfaces = 0;
  /// Surface is dropped, after trimming and remeshing, whose 95 % half-width exceeds this, cloud's unit, and with it
  /// what hangs on by single triangles; 0: none. Sigma is computed for it. It comes on top of what TrimmingOptions
  /// drop: with Trimming::none it alone decides.
  float maxError = 0;
};

/// Of the interval that holds the surface in 95 of 100 cases, to each side of a vertex.
constexpr double halfWidthPerSigma = 1.96;

/// \throw InvalidOption naming the first field that is out of range
PCL_MRF_EXPORT void validate(const UncertaintyOptions& options);

/// Of the sigma of some vertices, cloud's unit.
struct SigmaQuantiles {
  std::int64_t vertices = 0;
  double median = 0, percentile95 = 0, max = 0;
};

/// A number that belongs to a surface, over surfaces that sigma allows for; volumes are in the cloud's unit cubed.
struct SampledQuantity {
  double mean = 0, deviation = 0; ///< of the drawn surfaces
  double lower = 0, upper = 0;    ///< hold another one's, and so the true one's, in 95 of 100 cases: Student's t
};

/// What surfaces drawn from the posterior measure, moved as sigma says: the vertices of one move together, so that
/// errors cancel as far as they would. What sigma does not know of, these do not, either.
struct SampledShape {
  int surfaces = 0;       ///< 0: all else is zero
  bool isClosed = false;  ///< false: there is no volume
  SampledQuantity volume; ///< enclosed, as the curved surface through the vertices and their normals has it
  SampledQuantity area;   ///< of the triangles: what is rough on a smaller scale than they are is not in it
  std::array<SampledQuantity, 3> extent; ///< of the bounding box along x, y and z
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

  /// Mean distance of the surface from the points, along its normals, cloud's unit: trilinear voxels push a curved
  /// surface to one side. Errors that all of the surface shares do not cancel in a volume.
  double offset = 0;

  std::int64_t patches = 0;       ///< discs of points that were left out to be filled
  std::int64_t patchPoints = 0;   ///< in them
  double largestPatch = 0;        ///< diameter of the largest one, cloud's unit
  double largestOpening = 0;      ///< diameter of the largest filling, as trimming measures it
  double fillingFactor = 0;       ///< standard deviation of the data that the fillings' errors speak for, cloud's unit
  std::int64_t notCalibrated = 0; ///< vertices whose sigma is an extrapolation

  SigmaQuantiles measured; ///< of vertices with a confidence above 0
  SigmaQuantiles fillings; ///< of the others
  SampledShape shape;
};

} // namespace mrf
} // namespace pcl
