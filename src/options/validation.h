// SPDX-License-Identifier: BSD-3-Clause
/// Validation of the options of a stage.
#pragma once

#include <pcl/surface/mrf/options.h>

#include <tuple>

namespace pcl::mrf {

/// Checks the range of each member, but not combinations of members.
/// \throw InvalidOption naming the first one that is out of range, its value and the range
void requireRanges(const Options& options);

/// Checks the options of one stage. \throw InvalidOption likewise
template <typename Stage>
void validate(const Stage& stage)
{
  Options all;
  std::get<Stage&>(std::tie(all.normals, all.orientation, all.observation, all.prior, all.solver, all.multiscale,
                            all.trimming, all.remesher, all.uncertainty)) = stage;
  requireRanges(all);
}

} // namespace pcl::mrf
