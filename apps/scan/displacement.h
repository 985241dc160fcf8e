// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Fine structure on a smooth surface: a random band-limited height added along the normal.
#pragma once

#include "random.h"
#include "surface.h"

#include <vector>

namespace pcl {
namespace mrf {
namespace scan {

/// A sum of plane waves of one wavelength in random directions: an isotropic random height in space.
class Displacement {
public:
  /// \param amplitude root mean square of the height over space
  Displacement(double amplitude, double wavelength, Random& random);

  /// Height at a place, and its gradient.
  double height(const Eigen::Vector3d& position, Eigen::Vector3d& gradient) const;

  /// Moves the point along its displacement direction and turns its normal to that of the displaced surface.
  /// \return false where the surface folds over itself
  bool apply(SurfacePoint& point) const;

private:
  struct Wave {
    Eigen::Vector3d perLength; ///< turns per unit of length
    double phase;              ///< turns
  };
  std::vector<Wave> waves_;
  double scale_;
};

} // namespace scan
} // namespace mrf
} // namespace pcl
