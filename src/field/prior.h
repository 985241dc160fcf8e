// SPDX-License-Identifier: BSD-3-Clause
/// The priors (paper Sec. 3.3.1) as powers of the graph Laplacian on a voxel lattice, and what the
/// solver takes for each.
#pragma once

#include <pcl/surface/mrf/options.h>

#include <cmath>

namespace pcl::mrf {

/// Order k of a prior: 1, 2 or 3.
inline int order(Prior prior)
{
  return static_cast<int>(prior);
}

/// c_k: the center coefficient of L^k in the interior, 6, 42 or 324.
inline int centerCoefficient(Prior prior)
{
  return prior == Prior::membrane ? 6 : prior == Prior::thinPlate ? 42 : 324;
}

/// Length over which the prior smooths fully observed data, cloud's unit, see src/method.md. \pre 0 < beta < 1
inline double smoothingLength(const PriorOptions& options, double voxelSize)
{
  int power = order(options.kind);
  double coefficient = centerCoefficient(options.kind);
  if (options.energy == Energy::paper) {
    coefficient = power == 1 ? 3 : 18;
    power = power == 1 ? 1 : 3;
  }
  const double beta = options.beta;
  return voxelSize * std::pow(coefficient * beta / (1 - beta), -.5 / power);
}

/// All that a prior of another order needs beside the order k itself: its operator is L^k.
struct PriorConstants {
  int order;
  int degree; ///< of the smoother before and after the coarse correction
  /// Where nothing is observed, a correction in a band of longer waves than 2π over this many voxels spreads like a
  /// membrane: a band that is held at one end only would swing under L^k, which continues slopes and curvatures.
  double tautness;
  /// Share of the coarse correction that is taken, with observations at points and at voxels: the rediscretized L³
  /// overcorrects.
  double pointDamping, voxelDamping;
  double coarseShare; ///< of the weights of points, from grid to coarser grid, beside the 4^k/8 of the scale
};

/// Measured, see src/method.md. \param isWhole on whole levels, which are iterated on; bands get a few steps, and what
/// fills holes in these depends on the constants
inline PriorConstants priorConstants(Prior prior, bool isWhole)
{
  if (prior == Prior::membrane)
    return {1, 2, 0, 1, 1, 1};
  if (prior == Prior::thinPlate)
    return {2, isWhole ? 5 : 4, .35, 1, 1, 1};
  return isWhole ? PriorConstants{3, 4, .25, .6, .4, .5} : PriorConstants{3, 5, .25, .7, .4, .25};
}

} // namespace pcl::mrf
