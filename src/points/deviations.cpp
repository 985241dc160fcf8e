// SPDX-License-Identifier: BSD-3-Clause
#include "points/deviations.h"

#include <algorithm>
#include <limits>

namespace pcl::mrf {

const Eigen::Vector3f& sensorOf(const std::vector<Eigen::Vector3f>& positions, const std::vector<std::int32_t>& views,
                                const std::vector<Eigen::Vector3f>& sensors, std::size_t point)
{
  if (!views.empty() && views[point] >= 0 && static_cast<std::size_t>(views[point]) < sensors.size())
    return sensors[views[point]];
  const auto distance = [&](const Eigen::Vector3f& sensor) { return (sensor - positions[point]).squaredNorm(); };
  return *std::min_element(sensors.begin(), sensors.end(), [&](const Eigen::Vector3f& s, const Eigen::Vector3f& t) {
    return distance(s) < distance(t);
  });
}

std::vector<float> deviationsByLaw(const NoiseLaw& law, const std::vector<Eigen::Vector3f>& positions,
                                   const std::vector<std::int32_t>& views, const std::vector<Eigen::Vector3f>& sensors,
                                   Execution& execution)
{
  std::vector<float> deviations;
  if (sensors.empty() || !law.isByRange())
    return deviations;
  deviations.resize(positions.size());
  execution.forRange(static_cast<std::int64_t>(positions.size()), 1 << 14, [&](std::int64_t begin, std::int64_t end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const double range = (positions[i] - sensorOf(positions, views, sensors, i)).norm();
      // A point at its sensor has a range of 0, where a law without a constant knows no noise.
      deviations[i] = std::max(static_cast<float>(law.deviation(range)), std::numeric_limits<float>::min());
    }
  });
  return deviations;
}

} // namespace pcl::mrf
