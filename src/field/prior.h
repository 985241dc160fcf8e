// SPDX-License-Identifier: BSD-3-Clause
/// The priors (paper Sec. 3.3.1) as powers of the graph Laplacian on a voxel lattice, and the constants that the solver
/// uses for each.
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

/// Constants of the solver for a prior of order k, whose operator is L^k.
struct PriorConstants {
  int order;
  int degree; ///< of the smoother before and after the coarse correction
  /// Wave number, radians per voxel side: longer waves of a correction in a band spread like a membrane where nothing
  /// is observed. L^k continues slopes and curvatures, so that a band that is held at one end only would swing.
  double tautness;
  /// Share of the coarse correction that is taken, where points and where voxels are observed: L³ discretized anew on a
  /// coarse grid overcorrects.
  double pointDamping, voxelDamping;
  double coarseShare; ///< factor on the weights of points from a grid to the next coarser one, besides 4^k/8 for scale
};

/// Measured, see src/method.md. \param isWhole for whole levels, which are iterated until they converge; bands take a
/// few steps only, so that the filling of holes there depends on the constants
inline PriorConstants priorConstants(Prior prior, bool isWhole)
{
  if (prior == Prior::membrane)
    return {1, 2, 0, 1, 1, 1};
  if (prior == Prior::thinPlate)
    return {2, isWhole ? 5 : 4, .35, 1, 1, 1};
  return isWhole ? PriorConstants{3, 4, .25, .6, .4, .5} : PriorConstants{3, 5, .25, .7, .4, .25};
}

} // namespace pcl::mrf
