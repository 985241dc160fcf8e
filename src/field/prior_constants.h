// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What the solver takes for each order of the prior.
#pragma once

#include "field/prior.h"

#include <pcl/surface/mrf/options.h>

#include <array>

namespace pcl::mrf {

/// All that a prior of another order needs beside the order k itself: its operator is L^k.
struct PriorConstants {
  int order;
  int degree;     ///< of the smoother before and after the coarse correction, on whole levels
  int bandDegree; ///< the same in narrow bands
  /// Where nothing is observed, a correction in a band of longer waves than 2π over this many voxels spreads like a
  /// membrane. A band that is held at one end only would swing under L^k, which continues slopes and curvatures. For
  /// k = 2 the value that comes closest to the dense solution on three scans; for k = 3 .25 fills holes better than .35
  /// or .5 do.
  double tautness;
  /// Share of the coarse correction that is taken, with observations at points and at voxels. The rediscretized L³
  /// overcorrects: measured on a head of 1.2 million voxels, .3 to .5 needs half the iterations of 1; with observations
  /// at points, which come with weaker coarse weights, .6 to .8 does. Lower orders want all of it.
  double pointDamping, voxelDamping;
  double coarseShare; ///< of the weights of points, from grid to coarser grid, beside the 4^k/8 of the scale
};

/// Degrees for k = 3 measured on grids of 0.2 to 1.6 million voxels: 10 takes a third less work to 1e-4 than 8.
inline PriorConstants priorConstants(Prior prior)
{
  constexpr std::array<PriorConstants, 3> table = {{
      {1, 2, 2, 0, 1, 1, 1},
      {2, 5, 4, .35, 1, 1, 1},
      {3, 10, 5, .25, .7, .4, .25},
  }};
  return table[order(prior) - 1];
}

} // namespace pcl::mrf
