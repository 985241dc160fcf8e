// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The noise of each point, where a law of its range is known (the capture device's properties of Sec. 3.3.2).
#pragma once

#include "options/noise_law.h"

#include <pcl/surface/mrf/execution.h>

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// The sensor that saw a point: of its view, or the nearest one where the view is not known.
/// \param views index into sensors per point, or empty \pre there are sensors
const Eigen::Vector3f& sensorOf(const std::vector<Eigen::Vector3f>& positions, const std::vector<std::int32_t>& views,
                                const std::vector<Eigen::Vector3f>& sensors, std::size_t point);

/// σ of each point, cloud's unit; none if there are no sensors, or the law is none of the range. Parameters likewise.
std::vector<float> deviationsByLaw(const NoiseLaw& law, const std::vector<Eigen::Vector3f>& positions,
                                   const std::vector<std::int32_t>& views, const std::vector<Eigen::Vector3f>& sensors,
                                   Execution& execution);

} // namespace pcl::mrf
