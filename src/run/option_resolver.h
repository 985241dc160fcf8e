// SPDX-License-Identifier: BSD-3-Clause
/// From what was asked for to the numbers that a run takes.
#pragma once

#include "options/resolved_options.h"
#include "points/noise.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

namespace pcl::mrf {

/// Whether ℓ, and whether the voxel size, is left to hold-out cross-validation.
bool choosesSmoothing(const Options& options);
bool choosesResolution(const Options& options);

/// Whether the points are asked for their noise, unless the options name a smoothing length for all of them.
bool mayAskForNoise(const Options& options);

/// Replaces automatic values, step by step, as a run learns what they follow from. Given values stay as they are.
class OptionResolver {
public:
  /// Resolves the lengths that follow from the sampling density. \param requested validated
  OptionResolver(const Options& requested, const SamplingDensity& density);

  /// What is known so far: for the pilot runs, which choose the rest.
  const Options& soFar() const { return options_; }

  /// Resolves ℓ, the weight of the normals and the voxel size, as far as they are left to cross-validation; the report
  /// tells how. \param points as they are observed
  void chooseByData(const OrientedPoints& points, Report& report, Execution& execution);

  /// Before that, where it is known: ℓ follows it, unless that is given. \param deviation σ of the median point
  void knowNoise(double deviation);

  /// Instead of that, where neighbors share their errors, which left-out points cannot tell from shape: ℓ, voxels and
  /// edges are those of the model.
  void followNoise(const NoiseModel& noise);

  /// Resolves the limits of trimming. \param diagonal of the largest piece, cloud's unit
  void limitTrimming(float diagonal);

  /// Once the volumes are chosen, which is what an automatic padding asks for.
  ResolvedOptions resolved() const;

private:
  Options requested_, options_;
  float spacing_;
};

} // namespace pcl::mrf
