// SPDX-License-Identifier: BSD-3-Clause
/// Hold-out cross-validation: smoothing length, weight of the normals and voxels, chosen by the data (ours).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace pcl::mrf {

/// What is left to the data, chosen by hold-out cross-validation (ours; why so: src/method.md).
///
/// In up to 32 cubes of 22 voxels, spread over the cloud, some points are held out; the field is solved in each at the
/// finest level's resolution and scored by the first-order distance |d|/‖∇d‖ at those points. Nothing is solved twice
/// if one object makes all choices. The cost does not grow with the cloud, but for one pass over its positions. The
/// results do not depend on the number of threads.
class HoldOut {
public:
  /// \param points must outlive the object, as the execution must \param spacing l̄, cloud's unit, > 0
  /// \param voxelSize h of the finest level, cloud's unit, > 0
  /// \param observation its weight of the normals is used in choosing ℓ
  HoldOut(const OrientedPoints& points, float spacing, double voxelSize, Prior prior,
          const ObservationOptions& observation, Execution& execution);
  ~HoldOut();
  HoldOut(const HoldOut&) = delete;
  HoldOut& operator=(const HoldOut&) = delete;

  /// Chooses ℓ: every tenth point is held out.
  ///
  /// Of lengths in steps of √2 from .5 l̄ to 4 l̄ it is the minimum of the parabola through the best three, or the length
  /// that the noise found there asks for, if that is longer.
  SmoothingChoice chooseSmoothing();

  /// Chooses the weight of the normals, g²/ℓ², for the noise: .4 or 4.
  ///
  /// 4 where it brings discs that are held out nearer by 8 % and scattered points no farther, on clouds with noise of
  /// .2 l̄ and more. Not for normals estimated from the points: those around withheld points know of them.
  /// \param smoothing ℓ, \param noise as chooseSmoothing gives them, cloud's unit; the closest ℓ that it tries stands
  /// for this one
  float chooseGradientWeight(double smoothing, double noise);

  /// Chooses the voxel size: as fine as the data carry.
  ///
  /// The coarsest of h, √2 h, 2 h and 2.8 h whose mean and RMS distances at the held-out points are within 1 % of the
  /// finest one's, or whose mean is below .04 l̄ and a 50,000th of the cloud's diagonal.
  /// \param smoothing ℓ, cloud's unit, > 0, or the closest one that chooseSmoothing tries \param noise as
  /// chooseSmoothing gives it, or 0, cloud's unit
  ResolutionChoice chooseResolution(double smoothing, float gradientWeight, double noise);

private:
  class CrossValidation;
  std::unique_ptr<CrossValidation> validation_;
};

} // namespace pcl::mrf
