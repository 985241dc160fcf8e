// SPDX-License-Identifier: BSD-3-Clause
/// Hold-out cross-validation chooses the smoothing length, the weight of the normals and the voxel size (ours).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace pcl::mrf {

/// Chooses options from the data, see src/method.md, "Hold-out". If one object makes all choices, nothing is solved
/// twice. Except for one pass over the positions, the cost does not grow with the cloud. The results do not depend on
/// the number of threads.
class HoldOut {
public:
  virtual ~HoldOut() = default;

  /// Chooses ℓ, from .5 l̄ to 4 l̄.
  virtual SmoothingChoice chooseSmoothing() = 0;

  /// Chooses the weight of the normals, g²/ℓ²: .4, or 4 for noise.
  /// \pre the normals were not estimated from the points, which include the held-out ones
  /// \param smoothing ℓ, \param noise as chooseSmoothing returns them, cloud's unit; ℓ is rounded to one that
  /// chooseSmoothing tries
  virtual float chooseGradientWeight(double smoothing, double noise) = 0;

  /// Chooses the voxel size: h, √2 h, 2 h or 2.8 h, as fine as the data need.
  /// \param smoothing ℓ, cloud's unit, > 0, rounded to one that chooseSmoothing tries \param noise as chooseSmoothing
  /// returns it, or 0, cloud's unit
  virtual ResolutionChoice chooseResolution(double smoothing, float gradientWeight, double noise) = 0;
};

/// \param points must outlive the object, as must search, which holds them, and execution \param spacing l̄, cloud's
/// unit, > 0 \param voxelSize h of the finest level, cloud's unit, > 0 \param observation its weight of the normals is
/// used when ℓ is chosen
std::unique_ptr<HoldOut> makeHoldOut(const OrientedPoints& points, const NeighborSearch& search, float spacing,
                                     double voxelSize, Prior prior, const ObservationOptions& observation,
                                     Execution& execution);

} // namespace pcl::mrf
