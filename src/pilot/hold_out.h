// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Hold-out cross-validation: smoothing length, weight of the normals and voxels, chosen by the data (ours).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace pcl {
namespace mrf {

/// What is left to the data, chosen by hold-out cross-validation (ours).
///
/// In up to 32 cubes of 22 voxels, spread over the cloud, some points are held out; the field is solved in each at the
/// finest level's resolution and scored by the first-order distance |d|/‖∇d‖ at those points. Distances to the mesh
/// would not do as the score: a bumpy surface is close to everything. Alternatives are scored at the same points: what
/// is worse in the first cubes, by more than they differ by chance once in fifty times, is given up without asking the
/// others. Nothing is solved twice if one object makes all choices.
///
/// The cost does not grow with the cloud, but for one pass over its positions. The results do not depend on the number
/// of threads.
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
  /// Lengths are tried in steps of √2 from .5 l̄ to 4 l̄: first the one that the noise asks for, as it is seen at a long
  /// ℓ, then longer ones until the score rises, then shorter ones until it has risen by 1 %. The choice is the minimum
  /// of the parabola through the best three, or the length that the noise found there asks for, if that is longer. Not
  /// from the short end, because noise makes the shortest ℓ flatten the field, which scores well by accident. Where 8
  /// cubes see no noise at .5 l̄, and .71 l̄ does not do much better, the scan is clean and that is all; 3 cubes are
  /// enough where that is plain. Where the points lie in a layer so thick that the nearest 64 tell no surface, it is
  /// the length that the noise asks for, as 4 l̄ see it.
  SmoothingChoice chooseSmoothing();

  /// Chooses the weight of the normals, g²/ℓ², for the noise: .4 or 4.
  ///
  /// A filling leans on the normals at its rim, so discs that are held out, of 6 l̄ around the cubes' centers, tell what
  /// they are worth. 4 is chosen where it brings discs nearer by 8 % and scattered points no farther, on clouds with
  /// noise of .2 l̄ and more. On clean ones the positions are worth more: 4 makes the surface's distance from the points
  /// a third larger, on three head scans. Not for normals estimated from the points: those around withheld points know
  /// of them.
  /// \param smoothing ℓ, \param noise as chooseSmoothing gives them, cloud's unit; the closest ℓ that it tries stands
  /// for this one
  float chooseGradientWeight(double smoothing, double noise);

  /// Chooses the voxel size: as fine as the data carry.
  ///
  /// Oversampled and noisy clouds have more points than surface to tell of. The same points as for ℓ are held out, and
  /// scored on voxels of h, √2 h, 2 h and 2.8 h, all at the same places; the coarsest is chosen whose mean distance is
  /// within 1 % of the finest one's, or below .04 l̄ and a 50,000th of the cloud's diagonal, beneath which no scanner
  /// sees it. Most of a noisy cloud's distance is the noise, hence so little. All cubes are asked before larger voxels
  /// are taken; to refuse them a few that agree are enough, and the finest size, the slowest, is not tried where the
  /// larger one's distance cannot be seen.
  /// \param smoothing ℓ, cloud's unit, > 0, or the closest one that chooseSmoothing tries \param noise as
  /// chooseSmoothing gives it, or 0, cloud's unit
  ResolutionChoice chooseResolution(double smoothing, float gradientWeight, double noise);

private:
  class CrossValidation;
  std::unique_ptr<CrossValidation> validation_;
};

} // namespace mrf
} // namespace pcl
