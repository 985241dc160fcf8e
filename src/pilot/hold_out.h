// SPDX-License-Identifier: BSD-3-Clause
/// Hold-out cross-validation chooses the smoothing length, the weight of the normals and the voxel size (ours).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace pcl::mrf {

/// Chooses options from the data by hold-out cross-validation (ours; reasons: src/method.md).
///
/// In up to 32 cubes of 22 voxels, spread over the cloud, some points are held out. The field is solved in each cube at
/// the finest level's resolution and scored by the first-order distance |d|/‖∇d‖ at the held-out points. If one object
/// makes all choices, nothing is solved twice. Except for one pass over the positions, the cost does not grow with the
/// cloud. The results do not depend on the number of threads.
class HoldOut {
public:
  virtual ~HoldOut() = default;

  /// Chooses ℓ: every tenth point is held out.
  ///
  /// Lengths in steps of √2 from .5 l̄ to 4 l̄ are tried. The choice is the minimum of the parabola through the best
  /// length and the two next to it; or the length that its noise asks for, if longer and not much worse.
  virtual SmoothingChoice chooseSmoothing() = 0;

  /// Chooses the weight of the normals, g²/ℓ², for the noise: .4 or 4.
  ///
  /// It is 4 if the noise is at least .2 l̄ and 4 brings held-out discs nearer by 8 % and scattered held-out points no
  /// farther. \pre the normals were not estimated from the points, which include the held-out ones
  /// \param smoothing ℓ, \param noise as chooseSmoothing returns them, cloud's unit; ℓ is rounded to one that
  /// chooseSmoothing tries
  virtual float chooseGradientWeight(double smoothing, double noise) = 0;

  /// Chooses the voxel size: as fine as the data need.
  ///
  /// It is the coarsest of h, √2 h, 2 h and 2.8 h whose mean and RMS distances at the held-out points are within 1 % of
  /// those of h, or whose mean is below both .04 l̄ and a 50,000th of the cloud's diagonal.
  /// \param smoothing ℓ, cloud's unit, > 0, rounded to one that chooseSmoothing tries \param noise as chooseSmoothing
  /// returns it, or 0, cloud's unit
  virtual ResolutionChoice chooseResolution(double smoothing, float gradientWeight, double noise) = 0;
};

/// \param points must outlive the object, as must execution \param spacing l̄, cloud's unit, > 0
/// \param voxelSize h of the finest level, cloud's unit, > 0
/// \param observation its weight of the normals is used when ℓ is chosen
std::unique_ptr<HoldOut> makeHoldOut(const OrientedPoints& points, float spacing, double voxelSize, Prior prior,
                                     const ObservationOptions& observation, Execution& execution);

} // namespace pcl::mrf
