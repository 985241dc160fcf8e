// SPDX-License-Identifier: BSD-3-Clause
/// Exact signs of the determinants that geometric decisions depend on.
#pragma once

#include <Eigen/Core>

namespace pcl::mrf {

/// +1 if d is above the plane through a, b, c seen counter-clockwise from above, −1 if below, 0 if in it.
///
/// Exact for coordinates that were floats within a factor of 2²⁹ of each other: their differences are exact in double.
/// The determinant is computed in double, and with 256 bits if rounding may have changed its sign.
int orientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& d);

/// +1 if a, b, c turn left, −1 if right, 0 if they are collinear. Exact like the one above.
int orientation(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c);

} // namespace pcl::mrf
