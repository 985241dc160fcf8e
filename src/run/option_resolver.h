// SPDX-License-Identifier: BSD-3-Clause
/// Resolves automatic options to the numbers that a run takes.
#pragma once

#include "options/resolved_options.h"
#include "points/noise.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

namespace pcl::mrf {

/// True if hold-out cross-validation chooses ℓ, and the voxel size.
bool choosesSmoothing(const Options& options);
bool choosesResolution(const Options& options);

/// True if the noise is estimated from the points, unless the options give a smoothing length for all of them.
bool mayAskForNoise(const Options& options);

/// Replaces automatic values step by step, as a run learns the numbers they follow from. Given values stay as they are.
class OptionResolver {
public:
  /// Resolves the lengths that follow from the sampling density. \param requested validated
  OptionResolver(const Options& requested, const SamplingDensity& density);

  /// The options resolved so far, for the pilot runs that choose the rest.
  const Options& soFar() const { return options_; }

  /// Resolves ℓ, the weight of the normals and the voxel size as far as cross-validation chooses them, and reports how.
  /// \param points the points that are observed
  void chooseByData(const OrientedPoints& points, const NeighborSearch& search, Report& report, Execution& execution);

  /// Sets a known noise before chooseByData: ℓ follows it, unless it is given. \param deviation σ of the median point
  void knowNoise(double deviation);

  /// Replaces chooseByData if neighbors share their errors, which held-out points cannot tell from shape: ℓ, voxels and
  /// edges follow the noise model.
  void followNoise(const NoiseModel& noise);

  /// Resolves the limits of trimming. \param diagonal of the largest piece, cloud's unit
  void limitTrimming(float diagonal);

  /// All options resolved, also an automatic padding; soFar() keeps it 0, so that volumes grow at openings.
  ResolvedOptions resolved() const;

private:
  Options requested_, options_;
  float spacing_;
};

} // namespace pcl::mrf
