// SPDX-License-Identifier: BSD-3-Clause
/// How the confidence falls with the distance to the points (paper Sec. 3.3.3).
#pragma once

#include <pcl/surface/mrf/options.h>

#include <algorithm>

namespace pcl::mrf {

/// α at a distance from the nearest point. \param share d_E / dEmax, ≥ 0 \return 0..1
inline float confidenceAt(float share, ConfidenceShape shape)
{
  const float t = std::min(share, 1.f);
  return shape == ConfidenceShape::linear ? 1 - t : 1 - t * t;
}

} // namespace pcl::mrf
